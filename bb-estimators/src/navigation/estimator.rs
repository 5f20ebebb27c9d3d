//! The error-state Kalman filter as an estimator to declare in `robot!`.

mod aligning;
pub(super) mod course;
mod filter;
pub(super) mod health;
mod height;
mod input;
mod options;
mod output;
mod states;
pub(super) mod world;

pub use input::NavigationInputs;
pub use options::NavigationOptions;
pub use output::{NavigationOutput, NavigationOutputs, NavigationStatus, Verdicts};

use self::aligning::Aligning;
use self::filter::{Filter, Measured};
use self::health::{Limits, Watch};
use self::height::Heights;
use self::input::Mounting;
use self::world::World;
use super::eskf::{ImuMean, NAVIGATION, Navigation, Optional, Refusal, States, offset};
use super::history::History;
use crate::params::Params as _;
use bb_core::payload::Odometry;
use bb_core::{Context, Estimator, Fault, Reply};
use std::marker::PhantomData;

/// Samples of the IMU that late measurements may be older than: 1.3 s at 400 Hz.
const SAMPLES: usize = 512;
const MEASUREMENTS: usize = 128;
/// Each is a filter with all its states: more would be many hundred kilobytes.
const STATES: usize = 8;
type Past<S, const N: usize> = History<Filter<S, N>, SAMPLES, MEASUREMENTS, STATES>;

/// How far ahead of the IMU a measurement may be stamped, ns.
const LONGEST_LEAD_NS: i64 = 500_000_000;

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
///         estimator navigation: Eskf(heading = 90 deg) {
///             input imu: sensor::base::imu, driver;
///             input gnss: sensor::base::mast::antenna::gnss, optional;
///             input odometry: sensor::base::wheels, optional;
///         }
///     }
/// }
/// ```
///
/// `S` are its optional [states](States), and `N` is [`States::DIMENSION`]. Inputs and states that belong together are declared
/// together: without [`Optional::Keyframe`] there are no relative poses, without [`Optional::BarometerBias`] no pressures, and a state
/// needs the input that tells it. With [`Optional::WheelScale`], wheels are taken not to move sideways.
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
/// Another number, a state that is listed twice, and a scale of relative poses without their keyframe do not compile:
///
/// ```compile_fail
/// use bb_core::prelude::*;
/// use bb_estimators::Eskf;
/// use bb_estimators::navigation::Wheeled;
///
/// robot! {
///     robot Rover;
///
///     link base {
///         sensor imu: External<Imu>();
///         sensor wheels: External<Odometry>();
///         estimator navigation: Eskf<Odometry, Wheeled, 17>() {
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
/// The world is a local tangent frame, x east, y north, z up. Its origin is where the first fix was; without satellites, where
/// the filter started. It starts once the IMU has been at rest for a second, with the heading of the options, or, with
/// `heading_from_course`, once fixes show in which direction the robot travels. Until then it emits nothing.
///
/// Measurements are fused at the time of their stamps, up to a second late. A gate for each sensor refuses what does not fit; what
/// it has refused is in the status. The health of the estimator says when the position was dead-reckoned for too long, is less
/// certain than the options allow, or does not agree with what is measured.
#[derive(Debug)]
pub struct EskfEstimator<O = Odometry, S: States = Navigation, const N: usize = NAVIGATION> {
    options: NavigationOptions,
    mounting: Mounting,
    phase: Phase<S, N>,
    output: PhantomData<fn() -> O>,
}

#[derive(Debug)]
enum Phase<S: States, const N: usize> {
    Aligning(Box<Aligning>),
    Running(Box<Running<S, N>>),
}

#[derive(Debug)]
struct Running<S: States, const N: usize> {
    past: Past<S, N>,
    world: World,
    heights: Heights,
    watch: Watch,
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
        let mounting = Mounting::of(context)?;
        states::check::<S>(&mounting)?;
        let phase = Phase::Aligning(Box::new(Aligning::new(&options, None)));
        Ok(Self { options, mounting, phase, output: PhantomData })
    }

    fn handle_input(&mut self, inputs: NavigationInputs<'_>) -> Result<Reply<O>, Fault> {
        let sample = self.mounting.sample(inputs.imu.message());
        match &mut self.phase {
            Phase::Aligning(aligning) => {
                let start = aligning.take(&sample, &inputs, &self.options, &self.mounting);
                let reply = if aligning.takes_too_long() {
                    Reply::none().diverged("it has neither lain still nor seen a course, and cannot start")
                } else {
                    Reply::none()
                };
                if let Some((start, world)) = start {
                    let filter = Filter::new(&self.options, &start)?;
                    let past =
                        Past::new(filter, LONGEST_LEAD_NS).map_err(|refusal| Fault::new(refusal.to_string()))?;
                    let watch = Watch::new(self.limits());
                    self.phase =
                        Phase::Running(Box::new(Running { past, world, heights: Heights::default(), watch }));
                }
                Ok(reply)
            }
            Phase::Running(running) => match running.take(&sample, &inputs, &self.options, &self.mounting) {
                Ok(()) => Ok(running.reply(&self.mounting)),
                Err(Refusal::Gap { .. }) => {
                    tracing::info!("no sample for too long: it starts again");
                    let frame = running.world.first();
                    self.phase = Phase::Aligning(Box::new(Aligning::new(&self.options, frame)));
                    Ok(Reply::none().diverged("no sample of the IMU for too long"))
                }
                Err(refusal) => {
                    tracing::debug!(%refusal, "sample refused");
                    Ok(Reply::none())
                }
            },
        }
    }
}

impl<O, S: States, const N: usize> EskfEstimator<O, S, N> {
    fn limits(&self) -> Limits {
        let longest_s = self.options.longest_dead_reckoning;
        Limits {
            dead_reckoning_s: self.mounting.has_positions().then_some(longest_s),
            deviation: self.options.largest_deviation,
        }
    }
}

impl<S: States, const N: usize> Running<S, N> {
    fn take(
        &mut self,
        sample: &ImuMean,
        inputs: &NavigationInputs<'_>,
        options: &NavigationOptions,
        mounting: &Mounting,
    ) -> Result<(), Refusal> {
        self.past.propagate(sample)?;
        if let Some(fix) = inputs.gnss.filter(|fix| fix.is_new())
            && let Some(measured) = self.world.fix(&fix.payload, options, mounting)
        {
            self.fuse(fix.monotonic_time.as_nanos(), Measured::Gnss(measured));
        }
        if let Some(odometry) = inputs.odometry.filter(|odometry| odometry.is_new()) {
            let time_ns = odometry.monotonic_time.as_nanos();
            if offset::<S>(Optional::WheelScale).is_some() {
                let (speed, sideways) = mounting.wheels(&odometry.payload, options);
                self.fuse(time_ns, Measured::Wheels(speed));
                self.fuse(time_ns, Measured::Sideways(sideways));
            } else {
                self.fuse(time_ns, Measured::Odometry(mounting.velocity(&odometry.payload, options)));
            }
        }
        if let Some(pose) = inputs.pose.filter(|pose| pose.is_new()) {
            let measured = self.world.pose(&pose.payload, options, mounting);
            self.fuse(pose.monotonic_time.as_nanos(), Measured::Pose(measured));
        }
        if let Some(relative) = inputs.relative.filter(|relative| relative.is_new()) {
            let end_ns = relative.end.as_nanos();
            let measured = mounting.relative_pose(&relative.payload, options);
            self.fuse(end_ns, Measured::Relative(measured, end_ns));
        }
        if let Some(field) = inputs.magnetic_field.filter(|field| field.is_new()) {
            let measured = mounting.magnetic_heading(&field.payload, options);
            self.fuse(field.monotonic_time.as_nanos(), Measured::MagneticField(measured));
        }
        if let Some(pressure) = inputs.pressure.filter(|pressure| pressure.is_new())
            && let Some(at) = self.past.now().estimate()
        {
            let drop = self.world.drop(&at.position);
            if let Some(height) = self.heights.of_pressure(&pressure.payload, at, drop, options, mounting) {
                self.fuse(pressure.monotonic_time.as_nanos(), Measured::Pressure(height));
            }
        }
        if let Some(new_from_old) = self.past.now().position().and_then(|position| self.world.moves_on(&position)) {
            // What is in the history belongs to the world that is left.
            let mut filter = self.past.now().clone();
            filter.move_world(&new_from_old)?;
            self.past = Past::new(filter, LONGEST_LEAD_NS)?;
        }
        Ok(())
    }

    fn fuse(&mut self, time_ns: i64, measured: Measured) {
        if let Err(refusal) = self.past.update(time_ns, &measured) {
            tracing::debug!(%refusal, sensor = measured.name(), "measurement refused");
        }
    }

    fn reply<O: NavigationOutput>(&mut self, mounting: &Mounting) -> Reply<O> {
        let filter = self.past.now();
        let reply: Reply<O> = O::of(filter, &self.world, mounting).into();
        let counts = filter.counts();
        match filter.sight(&counts).and_then(|sight| self.watch.look(&sight)) {
            Some(reason) => reply.diverged(reason),
            None => reply,
        }
    }
}
