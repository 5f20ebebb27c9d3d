//! Configuration of the state estimator.

use crate::navigation::camera::Camera;
use crate::navigation::eskf::EskfParams;
use crate::params::{Params as _, ParamsError, params};

macro_rules! strategies {
    ($($(#[doc = $about:literal])+ #[$built:meta] $kind:ident = $name:literal, smoothing: $is_smoothing:literal;)+) => {
        /// The estimator in use. Each is available if the crate was built with the feature of its name.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum StrategyKind {
            $($(#[doc = $about])+ #[$built] $kind,)+
        }

        impl StrategyKind {
            /// The strategies that were built.
            pub const ALL: &'static [Self] = &[$(#[$built] Self::$kind,)+];

            /// Returns the name of the strategy: `smoother` or `eskf`.
            pub const fn name(self) -> &'static str {
                match self {
                    $(#[$built] Self::$kind => $name,)+
                }
            }

            /// Returns whether later measurements correct its keyframes.
            pub(super) const fn is_smoothing(self) -> bool {
                match self {
                    $(#[$built] Self::$kind => $is_smoothing,)+
                }
            }
        }
    };
}

strategies! {
    /// [`FixedLagSmoother`](crate::navigation::FixedLagSmoother), with the feature `smoother`: the default.
    #[cfg(feature = "smoother")]
    FixedLagSmoother = "smoother", smoothing: true;
    /// [`EskfFilter`](crate::navigation::EskfFilter), with the feature `eskf`: the simple baseline.
    #[cfg(feature = "eskf")]
    Eskf = "eskf", smoothing: false;
}

impl StrategyKind {
    /// The strategy with that name, if it was built.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|strategy| strategy.name() == name)
    }
}

impl Default for StrategyKind {
    fn default() -> Self {
        Self::ALL[0]
    }
}

params! {
    /// Times and limits of [`FlightNavigator`](super::FlightNavigator).
    pub struct StateEstimatorParams {
        /// Number of keyframes that are held, in the smoother's window or in the filter's history: from 2 to 100.
        window: u32 = 15;
        /// Largest delay of an input, behind the newest sample of the IMU, with which it is still placed where it belongs.
        ///
        /// Small: what takes longer to compute is refused. Large: costs memory, and time where something is late.
        ///
        /// Source: two seconds of keyframes at 10 Hz, and the time that a satellite image takes.
        lateness: f64 = 2.0, in 0.05..=10.0, unit "s";
        /// The most samples of the IMU a second. Memory is taken for as many, see
        /// [`StateEstimatorParams::room`](Self::room).
        ///
        /// Small: if more come, the oldest are dropped, and what is late is refused sooner. Large: costs memory, 56 bytes a
        /// sample.
        imu_rate: f64 = 400.0, in 1.0..=10_000.0, unit "Hz";
        /// The most inputs a second that are no samples of the IMU; a frame of the camera counts twice.
        ///
        /// Small: if more come, they are refused as an overflow. A quarter of the room is kept for relative poses, anchors and
        /// factors: a flight controller that floods takes none from them. Large: costs memory, about 700 bytes an input.
        input_rate: f64 = 128.0, in 1.0..=10_000.0, unit "Hz";
        /// Largest lead of an input's stamp over the newest sample of the IMU.
        lead: f64 = 0.5, in 0.0..=10.0, unit "s";
        /// Without camera frames, a keyframe is made after this time. A camera whose frames are farther apart is waited for: for up
        /// to one and a half times the time between its last two frames, and at most a second longer than this.
        keyframe_interval: f64 = 1.0, in 0.05..=10.0, unit "s";
        /// Estimates a second.
        output_rate: f64 = 5.0, in 0.1..=1000.0, unit "Hz";
        /// Time after the last sample of the IMU for which there is still an estimate.
        longest_prediction: f64 = 0.2, in 0.0..=1.0, unit "s";
        /// Time for which estimates may be missing before the flight controller's own IMU takes over.
        fallback_after: f64 = 3.0, in 0.1..=60.0, unit "s";
        /// Anchors and fixes of a trusted receiver that are older than this demote to `visual_propagated`.
        anchor_age: f64 = 3.0, in 0.1..=600.0, unit "s";
        /// Without a camera's, or a satellite's, measurement for this time it is dead reckoning.
        visual_loss: f64 = 1.0, in 0.05..=60.0, unit "s";
        /// Time for which a receiver that was spoofed must be healthy before it may be let in again.
        dwell: f64 = 10.0, in 0.0..=600.0, unit "s";
        /// Reports of its health that are farther apart break the dwell.
        health_gap: f64 = 2.0, in 0.05..=60.0, unit "s";
        /// Largest distance of its fix from the next anchor with which it is let in again.
        anchor_tolerance: f64 = 25.0, in 0.1..=1e4, unit "m";
        /// Largest distance of its fix from the estimate with which it is let in again.
        bounded_distance: f64 = 200.0, in 1.0..=1e6, unit "m";
        /// Factor of the flight controller's standard deviations at a warm start.
        warm_inflation: f64 = 2.0, in 1.0..=100.0;
        /// Standard deviation of each component of the velocity at take-off.
        takeoff_velocity: f64 = 0.5, in 1e-3..=100.0, unit "m/s";
        /// Heading of the body's x axis at take-off, from east counter-clockwise, if no attitude provides it.
        takeoff_heading: f64 = 0.0, in -7.0..=7.0, unit "rad";
        /// Standard deviation of the heading at take-off.
        takeoff_heading_deviation: f64 = 0.5, in 1e-6..=4.0, unit "rad";
        /// Standard deviation of the accelerometer's bias at the start.
        accelerometer_bias: f64 = 0.2, in 1e-6..=10.0, unit "m/s^2";
        /// Standard deviation of the gyroscope's bias at the start.
        gyroscope_bias: f64 = 0.02, in 1e-9..=1.0, unit "rad/s";
        /// A covariance that is larger than the steady one by this factor is warned of.
        growing_covariance: f64 = 2.0, in 1.1..=1e3;
        /// Number of landmarks that are held at once if there is a camera; more are refused.
        ///
        /// Small: landmarks are refused although their tracks would help. Large: costs time and memory, about 40 kB each, as the
        /// window is held nine times for what comes late. From 1 to 100,000.
        landmarks: u32 = 256;
        /// Events of keyframes that leave the window, for a recorder. They cost the smoother the covariance of its oldest keyframe.
        record_keyframes: bool = true;
    }
}

/// Complete configuration of a [`FlightNavigator`](super::FlightNavigator).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StateEstimatorConfig {
    /// Estimator that does the work.
    pub strategy: StrategyKind,
    /// Times and limits.
    pub params: StateEstimatorParams,
    /// The noise of the IMU, gravity and gaps.
    pub sensors: EskfParams,
    /// The camera whose landmarks are added, for the strategy with a window.
    pub camera: Option<Camera>,
    /// Beginning of the ids of frames. 0: a number that is made from the first sample of the IMU, another in each flight.
    pub flight: u64,
}

impl StateEstimatorConfig {
    pub(super) fn check(&self) -> Result<(), ParamsError> {
        self.params.check()?;
        self.sensors.check()?;
        self.camera.map_or(Ok(()), |camera| camera.check())?;
        let (window, min, max) = (self.params.window, 2, 100);
        if (min..=max).contains(&window) {
            return Ok(());
        }
        let [value, min, max] = [window, min, max].map(f64::from);
        Err(ParamsError { parameter: "window", value, min, max, unit: "" })
    }
}

impl StateEstimatorParams {
    /// Maximum numbers of IMU samples and of other inputs held: `imu_rate (1.25 lateness + keyframe_interval + 1)` and
    /// `input_rate (1.25 lateness + lead + 1)`. The memory for them is allocated when the estimator is created.
    ///
    /// Samples are needed since the oldest copy of the estimate, and since the keyframe before it. That copy is as old as an input
    /// may be late, plus at most a fifth of that.
    pub fn room(&self) -> [usize; 2] {
        let late = 1.25 * self.lateness + 1.0;
        // The cast saturates.
        let samples = self.imu_rate * (late + self.keyframe_interval);
        let inputs = self.input_rate * (late + self.lead);
        [samples, inputs].map(|most| (most as usize).max(LEAST_ROOM))
    }
}

/// Minimum capacity at any rates.
const LEAST_ROOM: usize = 32;

/// Seconds as nanoseconds.
pub(super) fn ns(seconds: f64) -> i64 {
    // The cast saturates.
    (seconds * 1e9) as i64
}
