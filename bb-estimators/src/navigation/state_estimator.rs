//! Position, velocity and attitude of a flight without satellite navigation.
//!
//! [`FlightNavigator`] takes samples of the flight controller's IMU, relative poses from a camera and poses from satellite images.
//! While it can be trusted, the flight controller's satellite receiver is used too. The configuration selects one of two
//! strategies: the fixed-lag smoother, with the filter beside it (feature `smoother`, the default), or the error-state Kalman filter
//! alone (feature `eskf`). Either can be built without the other.
//!
//! ```
//! # #[cfg(feature = "std")]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use bb_estimators::navigation::state_estimator::{
//!     AttitudeReading, Event, FlightNavigator, StateEstimatorConfig, TakeoffOrigin,
//! };
//! use bb_estimators::navigation::{Geodetic, ImuMean};
//! use nalgebra::{UnitQuaternion, Vector3};
//!
//! let log = |event: &Event| println!("{}: {}", event.level().name(), event.kind.name());
//! let mut estimator: FlightNavigator<_> = FlightNavigator::new(StateEstimatorConfig::default(), log)?;
//! estimator.set_takeoff_origin(TakeoffOrigin::new(Geodetic::from_degrees(48.0, 11.0, 500.0)))?;
//! estimator.add_attitude(AttitudeReading {
//!     time_ns: 5_000_000,
//!     world_from_body: UnitQuaternion::identity(),
//!     tilt_deviation: 0.01,
//!     heading_deviation: 0.1,
//! })?;
//! for i in 1..=200 {
//!     let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::new(0.0, 0.0, 9.80665));
//!     estimator.add_imu(&ImuMean { time_ns: i * 5_000_000, angular_velocity, specific_force })?;
//!     if let Some(output) = estimator.tick(i * 5_000_000) {
//!         println!("{}: {:?}, {}", output.frame_id, output.position, output.label);
//!     }
//! }
//! assert!(estimator.predicted(1_000_000_000).is_some());
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "std"))]
//! # fn main() {}
//! ```
//!
//! # One writer, one queue
//!
//! All inputs pass through one queue in the order of their stamps. An input that is late by at most
//! [`lateness`](StateEstimatorParams::lateness) is inserted in order, and everything after it is recomputed. The result is
//! bit-for-bit the same as for inputs that arrive in order (`tests/order.rs`). Older inputs are rejected and counted.
//!
//! # Errors
//!
//! *Degraded*: the input was left out of the estimate, or has moved it elsewhere; there is an estimate. *Fatal*: there is no estimate
//! for this tick; the input that caused the failure is excluded from then on. Each success and each failure is an [`Event`], with its
//! reason. If a late input changes what an earlier one became, that is an event as it would have been at once, and each is reported
//! once. After three seconds without an estimate, exactly one event reports this, and one more reports when an estimate is available
//! again.
//!
//! # Conventions
//!
//! As in [`navigation`](super). Positions are WGS 84; orientations and covariances are in the tangent frame at the position. The
//! strategies move to a new world when the robot is more than 5 km from the origin of the current one.

mod clock;
#[cfg(feature = "runtime")]
mod declared;
mod emission;
mod engine;
mod entry;
mod error;
mod estimator;
mod event;
mod factor;
mod fallback;
mod gate;
mod given;
mod ids;
mod input;
mod label;
mod named;
mod output;
mod params;
mod queue;
mod start;
mod status_text;
mod strategy;
#[cfg(test)]
mod tests;
mod world;

#[cfg(feature = "runtime")]
pub use declared::{
    AnchorReading, AttitudeReport, FactorReading, FeaturesReading, FlightEstimate, FlightEstimator, FlightEvent,
    FlightEvents, FlightHealth, FlightInputs, FlightOptions, FlightOutputs, GpsReport, HealthSnapshot,
    RelativePoseReading, SmoothedHistory, TracingSink, WarmStartReport,
};
pub use error::{EstimatorError, OriginError, Reason};
pub use estimator::{Added, FlightNavigator};
pub use event::{Event, EventKind, EventSink, InputKind, Level, StartedFrom};
pub use factor::ProvidedFactor;
pub use factor::{SMOOTHED, Smoothed};
pub use gate::{GateState, Rejection};
pub use given::{FactorForm, GivenFactor, LinearFactor, RelativeFactor};
pub use input::{
    AttitudeReading, Feature, FlightControllerState, FlightControllerWindow, GnssReading, GpsHealth,
    GpsHealthReading, ImageFeatures, ImuBias, PoseAnchor, TakeoffOrigin, VioOutput,
};
pub use label::SourceLabel;
pub use output::{EstimatorHealth, EstimatorOutput, HealthState, Quality};
pub use params::{StateEstimatorConfig, StateEstimatorParams, StrategyKind};
pub use queue::QueueCounts;
pub use status_text::StatusText;
