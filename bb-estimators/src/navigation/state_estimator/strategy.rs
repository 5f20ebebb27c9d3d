//! The two estimation strategies and their common interface.

mod eskf;
mod predictor;
#[cfg(feature = "smoother")]
mod smoother;

use alloc::boxed::Box;
use alloc::vec::Vec;

use nalgebra::{Isometry3, Matrix6, SMatrix, UnitQuaternion, Vector3};

pub(super) use self::predictor::Predictor;
use super::error::EstimatorError;
use super::factor::ProvidedFactor;
use super::params::{StateEstimatorConfig, StrategyKind, ns};
use crate::attitude::ParamsError;
use crate::navigation::eskf::{ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity, RelativePose};
use crate::navigation::numbers::CAMERA_SLACK_NS;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, POSITION, ROTATION};
use crate::navigation::stream::{Stream, StreamParams};

/// A pose in the world of the engine, and its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    pub(super) time_ns: i64,
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) world_from_body: UnitQuaternion<f64>,
    /// Position error, then rotation error.
    pub(super) covariance: Matrix6<f64>,
}

impl Pose {
    fn of<const N: usize>(estimate: &Estimate<N>, covariance: &SMatrix<f64, N, N>) -> Self {
        let index = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        let Estimate { time_ns, position, velocity, world_from_body, .. } = *estimate;
        let covariance = Matrix6::from_fn(|i, j| covariance[(index(i), index(j))]);
        Self { time_ns, position, velocity, world_from_body, covariance }
    }

    pub(super) fn is_finite(&self) -> bool {
        let vectors = [&self.position, &self.velocity];
        vectors.iter().all(|vector| vector.iter().all(|x| x.is_finite()))
            && self.world_from_body.coords.iter().all(|x| x.is_finite())
            && self.covariance.iter().all(|x| x.is_finite())
            && self.covariance.diagonal().iter().all(|x| *x > 0.0)
    }
}

/// A measurement, in the world of the engine.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measured<'a, F> {
    Relative(RelativePose),
    Anchor(AbsolutePose),
    Gnss(GnssPosition, Option<GnssVelocity>, Trust),
    Provided(&'a F),
}

/// Permission of a fix that does not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    /// None: it is refused.
    Doubted,
    /// The position may show that the estimate is in the wrong place.
    Believed,
}

/// A gate per kind of measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Streams {
    pub(super) relative: Stream,
    pub(super) anchors: Stream,
    pub(super) positions: Stream,
    pub(super) velocities: Stream,
    pub(super) provided: Stream,
}

impl Streams {
    fn new() -> Self {
        let stream = Stream::default();
        // Positions have the gate of the copies.
        let open = Stream::new(StreamParams { gate: 0.0, ..*stream.params() });
        Self { relative: stream, anchors: open, positions: open, velocities: stream, provided: stream }
    }
}

/// Timing of keyframes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cadence {
    interval_ns: i64,
    keyframe_ns: i64,
    camera_ns: i64,
    /// Time between the last two frames of the camera.
    spacing_ns: i64,
}

impl Cadence {
    fn new(config: &StateEstimatorConfig) -> Self {
        let interval_ns = ns(config.params.keyframe_interval);
        Self { interval_ns, keyframe_ns: i64::MIN, camera_ns: i64::MIN, spacing_ns: 0 }
    }

    /// Starts at a time, which counts as a frame.
    fn begin(&mut self, time_ns: i64) {
        (self.keyframe_ns, self.camera_ns) = (time_ns, time_ns);
    }

    /// The newest keyframe is a frame of the camera.
    fn camera_frame(&mut self) {
        if self.keyframe_ns > self.camera_ns {
            self.spacing_ns = self.keyframe_ns.saturating_sub(self.camera_ns);
            self.camera_ns = self.keyframe_ns;
        }
    }

    /// Returns the time to wait for the next frame: a keyframe between two frames would separate them.
    fn patience_ns(&self) -> i64 {
        (self.spacing_ns / 2).saturating_mul(3).min(self.interval_ns.saturating_add(CAMERA_SLACK_NS))
    }

    fn awaits_camera(&self, now_ns: i64, at_least_ns: i64) -> bool {
        now_ns.saturating_sub(self.camera_ns) <= self.patience_ns().max(at_least_ns)
    }

    /// Returns whether a keyframe is due without a camera.
    fn is_due(&self, now_ns: i64) -> bool {
        now_ns.saturating_sub(self.keyframe_ns) >= self.interval_ns && !self.awaits_camera(now_ns, 0)
    }

    /// Returns whether the camera determines the times of keyframes.
    fn has_camera(&self, now_ns: i64) -> bool {
        self.awaits_camera(now_ns, self.interval_ns / 2)
    }
}

/// Raises the covariance of the position by what a body moves in a time with this standard deviation, s.
fn add_time<const N: usize>(covariance: &mut SMatrix<f64, N, N>, velocity: &Vector3<f64>, deviation_s: f64) {
    let way = velocity * deviation_s;
    let mut of_position = covariance.fixed_view_mut::<3, 3>(POSITION, POSITION);
    of_position += way * way.transpose();
}

/// Converts a stamp to an id that increases with it.
pub(super) fn id_of(time_ns: i64) -> u64 {
    (time_ns as u64) ^ (1 << 63)
}

/// The strategy in use.
#[derive(Clone, Debug)]
pub(super) enum Strategy<F: ProvidedFactor> {
    #[cfg(feature = "smoother")]
    Smoother(Box<smoother::SmootherStrategy<F>>),
    Eskf(Box<eskf::EskfStrategy>, core::marker::PhantomData<fn() -> F>),
}

macro_rules! each {
    ($self:expr, $strategy:ident => $do:expr) => {
        match $self {
            #[cfg(feature = "smoother")]
            Strategy::Smoother($strategy) => $do,
            Strategy::Eskf($strategy, _) => $do,
        }
    };
}

impl<F: ProvidedFactor> Strategy<F> {
    /// Creates a strategy that has not started.
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        Ok(match config.strategy {
            #[cfg(feature = "smoother")]
            StrategyKind::FixedLagSmoother => Self::Smoother(Box::new(smoother::SmootherStrategy::new(config)?)),
            #[cfg(feature = "eskf")]
            StrategyKind::Eskf => Self::Eskf(Box::new(eskf::EskfStrategy::new(config)?), core::marker::PhantomData),
        })
    }

    /// Starts or restarts.
    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        each!(self, strategy => strategy.start(start))
    }

    /// Advances to a time within one sample, which began at `since_ns`. Makes a keyframe if one is due.
    pub(super) fn propagate(
        &mut self,
        until_ns: i64,
        sample: &ImuMean,
        since_ns: i64,
    ) -> Result<(), EstimatorError> {
        each!(self, strategy => strategy.propagate(until_ns, sample, since_ns))
    }

    /// Makes the present state a keyframe: a camera has captured a frame.
    pub(super) fn frame(&mut self) -> Result<(), EstimatorError> {
        each!(self, strategy => strategy.camera_frame())
    }

    /// Fuses a measurement at the present time.
    pub(super) fn measure(&mut self, measured: &Measured<'_, F>) -> Result<Fused, EstimatorError> {
        each!(self, strategy => strategy.measure(measured))
    }

    /// Returns whether the last correction has converged. If not, the covariance is not to be trusted.
    pub(super) fn is_converged(&self) -> bool {
        each!(self, strategy => strategy.is_converged())
    }

    /// Returns whether the heading is known. After an outage of the IMU it is not, until it has been determined again.
    pub(super) fn is_attitude_known(&self) -> bool {
        each!(self, strategy => strategy.is_attitude_known())
    }

    /// Present position and velocity.
    pub(super) fn motion(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        each!(self, strategy => strategy.motion())
    }

    /// The attitude at the present time.
    pub(super) fn attitude(&self) -> Option<UnitQuaternion<f64>> {
        each!(self, strategy => strategy.attitude())
    }

    /// Number of gaps in the IMU samples that were bridged.
    pub(super) fn gaps(&self) -> u32 {
        each!(self, strategy => strategy.gaps())
    }

    /// The predictor from the newest estimate, if there is one.
    pub(super) fn predictor(&self) -> Option<Predictor> {
        each!(self, strategy => strategy.predictor())
    }

    /// The newest keyframe.
    pub(super) fn newest(&self) -> Option<Pose> {
        each!(self, strategy => strategy.newest())
    }

    /// Keyframes before the newest, in reverse order of time, and whether they are smoothed.
    pub(super) fn history(&mut self, most: usize) -> (Vec<Pose>, bool) {
        each!(self, strategy => strategy.history(most))
    }

    /// The next of the keyframes that have left the window, if any.
    pub(super) fn take_left(&mut self) -> Option<Pose> {
        each!(self, strategy => strategy.take_left())
    }

    /// Time of the newest keyframe, ns.
    pub(super) fn keyframe_ns(&self) -> i64 {
        each!(self, strategy => strategy.keyframe_ns())
    }

    /// Number of keyframes held.
    pub(super) fn keyframes(&self) -> usize {
        each!(self, strategy => strategy.keyframes())
    }

    /// The gates, with what each has refused.
    pub(super) fn streams(&self) -> &Streams {
        each!(self, strategy => strategy.streams())
    }

    /// Returns how often it started, or went on in another place.
    pub(super) fn resets(&self) -> u32 {
        each!(self, strategy => strategy.resets())
    }

    /// Assigns a new time to the present state, with the standard deviation of that time, s. Keyframes are dropped.
    pub(super) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) -> Result<(), EstimatorError> {
        each!(self, strategy => strategy.set_clock(time_ns, deviation_s))
    }

    /// Moves to another world.
    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), EstimatorError> {
        each!(self, strategy => strategy.move_world(new_from_old))
    }
}
