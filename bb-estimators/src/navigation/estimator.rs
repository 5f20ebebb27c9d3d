//! The error-state Kalman filter as an estimator to declare in `robot!`.

pub(super) mod course;
mod filter;
mod height;
mod input;
#[cfg(test)]
mod laws;
pub(super) mod life;
pub(super) mod measured;
mod options;
mod output;
mod report;
mod starting;
mod states;

pub use course::Course;
pub use input::NavigationInputs;
pub use life::Verdicts;
pub use options::NavigationOptions;
pub use output::{NavigationOutput, NavigationOutputs};
pub use report::NavigationStatus;

use self::input::Setup;
use self::life::Life;
use self::starting::Starting;
use super::state::{NAVIGATION, Navigation, States};
use crate::params::Params as _;
use bb_core::payload::Odometry;
use bb_core::{Context, Estimator, Fault, Reply};
use std::marker::PhantomData;

/// Position, velocity and attitude of the link where it is declared, from an IMU and any of satellite navigation, wheels or
/// another odometry, poses in the world or relative to each other, a magnetometer and a barometer. It emits [`Odometry`] with every
/// sample of the IMU, or [`NavigationOutputs`].
///
/// ```
/// # fn main() {}
/// use bb_core::prelude::*;
/// use bb_estimators::Eskf;
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
///         estimator navigation: Eskf() {
///             input imu: sensor::base::imu, driver;
///             input gnss: sensor::base::mast::antenna::gnss, optional;
///             input odometry: sensor::base::wheels, optional;
///         }
///     }
/// }
/// ```
///
/// Its inputs bring their states: the delay of fixes, the bias of a barometer, the scale of wheels and the mounting of the IMU among
/// them, a keyframe and the scale of relative poses. Other [states](States) are declared as `S`, with `N` = [`States::DIMENSION`]:
/// relative poses then require `Optional::Keyframe`, pressures require `Optional::BarometerBias`, and a state needs the input that
/// makes it observable.
///
/// ```
/// # fn main() {}
/// use bb_core::payload::{FluidPressure, RelativePose};
/// use bb_core::prelude::*;
/// use bb_estimators::Eskf;
/// use bb_estimators::navigation::{Optional, States};
///
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// pub struct Drone;
///
/// impl States for Drone {
///     const OPTIONAL: &'static [Optional] = &[Optional::Keyframe, Optional::RelativeScale, Optional::BarometerBias];
/// }
///
/// robot! {
///     robot Quadrotor;
///
///     link body {
///         sensor imu: External<Imu>();
///         sensor camera: External<RelativePose>();
///         sensor barometer: External<FluidPressure>();
///         estimator navigation: Eskf<Odometry, Drone, { Drone::DIMENSION }>() {
///             input imu: sensor::body::imu, driver;
///             input relative: sensor::body::camera, optional;
///             input pressure: sensor::body::barometer, optional;
///         }
///     }
/// }
/// ```
///
/// A wrong dimension, a state listed twice, and a scale of relative poses without their keyframe do not compile:
///
/// ```compile_fail
/// use bb_core::prelude::*;
/// use bb_estimators::Eskf;
/// use bb_estimators::navigation::Vehicle;
///
/// robot! {
///     robot Rover;
///
///     link base {
///         sensor imu: External<Imu>();
///         sensor wheels: External<Odometry>();
///         estimator navigation: Eskf<Odometry, Vehicle, 17>() {
///             input imu: sensor::base::imu, driver;
///             input odometry: sensor::base::wheels, optional;
///         }
///     }
/// }
///
/// fn main() -> Result<(), StartError> {
///     Rover::builder().simulate().map(drop)
/// }
/// ```
///
/// ```compile_fail
/// use bb_core::payload::RelativePose;
/// use bb_core::prelude::*;
/// use bb_estimators::Eskf;
/// use bb_estimators::navigation::{Optional, States};
///
/// #[derive(Clone, Copy, Debug, PartialEq)]
/// pub struct Scaled;
///
/// impl States for Scaled {
///     const OPTIONAL: &'static [Optional] = &[Optional::RelativeScale];
/// }
///
/// robot! {
///     robot Drone;
///
///     link body {
///         sensor imu: External<Imu>();
///         sensor camera: External<RelativePose>();
///         estimator navigation: Eskf<Odometry, Scaled, { Scaled::DIMENSION }>() {
///             input imu: sensor::body::imu, driver;
///             input relative: sensor::body::camera, optional;
///         }
///     }
/// }
///
/// fn main() -> Result<(), StartError> {
///     Drone::builder().simulate().map(drop)
/// }
/// ```
///
/// The world is a local tangent frame: x east, y north, z up. Its origin is the first fix that the next fix confirmed or, without
/// satellite navigation, the position where the filter started. The filter starts after the IMU has been at rest for a second, or in
/// motion once three fixes agree. Until then it emits nothing. An unknown heading is found by itself as soon as the robot moves; until
/// then the estimator is degraded.
///
/// Positions that agree with each other for 20 s, but not with the filter, move it to them, and `resets` in its status is
/// incremented. If they are on another part of the Earth, the estimator ends, and its supervisor starts it there.
///
/// Measurements are fused at the time of their stamps, up to a second late. A gate per sensor rejects outliers, and the status
/// reports the rejections. The health of the estimator reports a position dead-reckoned for too long, an uncertainty above the
/// limit in the options, and disagreement with the measurements.
#[derive(Debug)]
pub struct EskfEstimator<O = Odometry, S: States = Navigation, const N: usize = NAVIGATION> {
    life: Life<Starting>,
    types: PhantomData<fn(S) -> O>,
}

impl<O: NavigationOutput, S: States + Send + 'static, const N: usize> Estimator for EskfEstimator<O, S, N> {
    type Options = NavigationOptions;
    type Input = NavigationInputs<'static>;
    type Output = O;

    fn init(options: NavigationOptions, context: &Context) -> Result<Self, Fault> {
        options.params().check()?;
        const {
            assert!(
                states::is_possible::<S>(),
                "`Optional::RelativeScale` needs `Optional::Keyframe`: the scale is that of poses relative to it"
            );
        }
        let setup = Setup::new(options, context)?;
        states::check::<S>(&setup)?;
        Ok(Self { life: Life::new(setup), types: PhantomData })
    }

    fn handle_input(&mut self, inputs: NavigationInputs<'_>) -> Result<Reply<O>, Fault> {
        let sample = measured::sample(inputs.imu.message(), &self.life.setup.link_from_imu.rotation);
        self.life.take(&sample, &inputs, states::started::<S, N>, O::of)
    }
}
