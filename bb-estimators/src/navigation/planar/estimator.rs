//! The planar filter as an estimator to declare in `robot!`.

mod filter;
mod input;
mod options;
mod output;
mod report;
mod starting;

pub use input::PlanarInputs;
pub use options::PlanarOptions;
pub use output::{PlanarOutput, PlanarOutputs};
pub use report::PlanarStatus;

use self::filter::started;
use self::input::Setup;
use self::starting::Starting;
use crate::navigation::estimator::life::Life;
use crate::navigation::estimator::measured::sample;
use crate::params::Params as _;
use bb_core::payload::Odometry;
use bb_core::{Context, Estimator, Fault, Reply};
use std::marker::PhantomData;

/// Position, heading and velocity of the link where it is declared, for a robot that drives on a plane. It uses an IMU and any of
/// wheels, satellite navigation, poses and orientations in the world. It emits [`Odometry`] with every IMU sample, or
/// [`PlanarOutputs`].
///
/// ```
/// # fn main() {}
/// use bb_core::prelude::*;
/// use bb_estimators::PlanarEkf;
///
/// robot! {
///     robot Rover;
///
///     link base {
///         sensor imu: External<Imu>();
///         sensor wheels: External<Odometry>();
///         joint mast: fixed {
///             origin: { xyz: [0 m, 0 m, 1.2 m] };
///             link antenna { sensor gnss: External<GnssFix>(); }
///         }
///         estimator navigation: PlanarEkf() {
///             input imu: sensor::base::imu, driver;
///             input gnss: sensor::base::mast::antenna::gnss, optional;
///             input odometry: sensor::base::wheels, optional;
///         }
///     }
/// }
/// ```
///
/// The world is a local tangent frame: x east, y north. Its origin is the first fix or, without satellite navigation, the link's
/// position at the start. The filter starts with the first sample or pose or, with satellite navigation, with the second fix that
/// agrees with the first, in motion or at rest. An unknown heading is found by itself as soon as the robot moves; until then the
/// estimator is degraded. Without wheels, it starts once the robot moves, forwards.
///
/// Positions that agree with each other for 20 s, but not with the filter, move it to them, and `resets` in its status is
/// incremented. If they are on another part of the Earth, the estimator ends, and its supervisor starts it there.
///
/// Measurements are fused at the time of their stamps, up to a second late. A gate per sensor rejects outliers. The health is
/// that of [`EskfEstimator`](crate::navigation::EskfEstimator).
#[derive(Debug)]
pub struct PlanarEstimator<O = Odometry> {
    life: Life<Starting>,
    output: PhantomData<fn() -> O>,
}

impl<O: PlanarOutput> Estimator for PlanarEstimator<O> {
    type Options = PlanarOptions;
    type Input = PlanarInputs<'static>;
    type Output = O;

    fn init(options: PlanarOptions, context: &Context) -> Result<Self, Fault> {
        options.params().check()?;
        Ok(Self { life: Life::new(Setup::new(options, context)?), output: PhantomData })
    }

    fn handle_input(&mut self, inputs: PlanarInputs<'_>) -> Result<Reply<O>, Fault> {
        let sample = sample(inputs.imu.message(), &self.life.setup.body_from_imu);
        self.life.take(&sample, &inputs, started, O::of)
    }
}
