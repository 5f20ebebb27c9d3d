//! Any attitude filter as an estimator to declare in `robot!`.

mod input;

pub use input::{Frames, ImuAndMagnetometer, InertialInput, InertialInputs};

use super::AttitudeFilter;
use bb_core::payload::{Imu, Orientation};
use bb_core::{Context, Estimator, Fault, Inputs, Options, Reply};
use std::marker::PhantomData;

/// The attitude filter `F` as an estimator that takes `I`: [`Imu`], [`Marg`](bb_core::payload::Marg) or
/// [`ImuAndMagnetometer`].
///
/// It emits the orientation of the frame where it is declared: in a sensor that sensor's, on a link that link's, to
/// which the samples are turned first. Angular velocity and field are those of the whole rigid body; specific force
/// is taken as measured, without the lever arm between sensor and link.
///
/// A sample that the filter refuses (time that stands still, absurd values) leaves it as it was and emits nothing.
#[derive(Debug)]
pub struct Attitude<F, I = Imu> {
    filter: F,
    frames: Frames,
    input: PhantomData<fn(I)>,
}

impl<F, I> Estimator for Attitude<F, I>
where
    F: AttitudeFilter<Params: Options> + Send + 'static,
    I: InertialInput,
{
    type Options = F::Params;
    type Input = I;
    type Output = Orientation;

    fn init(params: F::Params, context: &Context) -> Result<Self, Fault> {
        Ok(Self { filter: F::new(params)?, frames: Frames::of(context), input: PhantomData })
    }

    fn handle_input(&mut self, input: <I as Inputs>::View<'_>) -> Result<Reply<Orientation>, Fault> {
        if let Err(error) = self.filter.update(&I::sample(&input, &self.frames)) {
            tracing::debug!(%error, "sample refused");
            return Ok(Reply::none());
        }
        Ok(self.filter.world_from_body().map(Orientation::new).into())
    }
}
