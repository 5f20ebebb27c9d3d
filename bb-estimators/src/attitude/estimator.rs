//! Any attitude filter as an estimator to declare in `robot!`.

mod input;
mod output;

pub use input::{Frames, ImuAndMagnetometer, InertialInput, InertialInputs};
pub use output::{AttitudeOutput, AttitudeOutputs, AttitudeStatus};

use super::AttitudeFilter;
use bb_core::payload::{Imu, Orientation};
use bb_core::{Context, Estimator, Fault, Inputs, Options, Reply};
use std::marker::PhantomData;

/// The attitude filter `F` as an estimator that takes `I`: [`Imu`], [`Marg`](bb_core::payload::Marg) or
/// [`ImuAndMagnetometer`]; and emits `O`: [`Orientation`], or [`AttitudeOutputs`] with its other estimates.
///
/// It emits the orientation of the frame where it is declared: the sensor's frame in a sensor, the link's on a link.
/// The samples are first rotated to that frame. Angular velocity and field are those of the whole rigid body;
/// specific force is used as measured, without the lever arm between sensor and link.
///
/// ```
/// # fn main() {}
/// use bb_core::prelude::*;
/// use bb_estimators::Vqf;
/// use bb_estimators::attitude::AttitudeOutputs;
///
/// robot! {
///     robot Stick;
///
///     link body {
///         sensor imu: External<Marg>() {
///             estimator plain: Vqf<Marg>();
///             estimator full: Vqf<Marg, AttitudeOutputs>() {
///                 output orientation;
///                 output status;
///             }
///         }
///     }
/// }
/// ```
///
/// A sample refused by the filter (non-increasing time, absurd values) changes nothing and emits nothing.
#[derive(Debug)]
pub struct Attitude<F, I = Imu, O = Orientation> {
    filter: F,
    frames: Frames,
    types: PhantomData<fn(I) -> O>,
}

impl<F, I, O> Estimator for Attitude<F, I, O>
where
    F: AttitudeFilter<Params: Options> + Send + 'static,
    I: InertialInput,
    O: AttitudeOutput,
{
    type Options = F::Params;
    type Input = I;
    type Output = O;

    fn init(params: F::Params, context: &Context) -> Result<Self, Fault> {
        Ok(Self { filter: F::new(params)?, frames: Frames::of(context)?, types: PhantomData })
    }

    fn handle_input(&mut self, input: <I as Inputs>::View<'_>) -> Result<Reply<O>, Fault> {
        if let Err(error) = self.filter.update(&I::sample(&input, &self.frames)) {
            tracing::debug!(%error, "sample refused");
            return Ok(Reply::none());
        }
        Ok(O::of(&self.filter).into())
    }
}
