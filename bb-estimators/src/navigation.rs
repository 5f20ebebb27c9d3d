//! Position, velocity and attitude from inertial sensors and whatever else a robot has.
//!
//! Conventions of every file below:
//!
//! * The world is a local tangent frame: x east, y north, z up, gravity along -z.
//! * The body is the IMU: its origin is where the accelerometer is, its axes are those of the IMU.
//! * `world_from_body` takes coordinates in the body to the world.
//! * An accelerometer measures specific force: at rest it reads one g upwards.
//! * All quantities are SI; stamps are nanoseconds since any fixed moment.
//!
//! [`EskfFilter`] is the filter, one type parameter for its optional states; [`Alignment`] finds where it starts. Sensors are
//! values that implement [`Measurement`], see [`measurement`] for how to add one, each with a [`Stream`] that holds its gate,
//! counts and statistics. [`History`] fuses measurements that come late at their own time. [`Copies`] are
//! several filters of which the likeliest is the estimate. [`planar`] has the filter of a robot that drives on
//! a plane. `FixedLagSmoother`, with the feature `smoother`,
//! holds the last keyframes and corrects them in hindsight.

mod alignment;
mod bounds;
mod camera;
pub mod chi_square;
mod consistency;
#[cfg(feature = "alloc")]
mod copies;
mod covariance;
pub mod eskf;
#[cfg(feature = "runtime")]
mod estimator;
mod factor;
mod fused;
mod fusion;
mod geodesy;
mod history;
mod layout;
mod math;
pub mod measurement;
#[cfg(test)]
mod noise;
mod numbers;
pub mod planar;
mod propagate;
mod refusal;
#[cfg(feature = "smoother")]
pub mod smoother;
mod state;
#[cfg(any(feature = "smoother", feature = "eskf"))]
pub mod state_estimator;
mod stream;
mod track;
mod update;
mod upkeep;

pub use alignment::{Alignment, AlignmentParams};
pub use camera::{Camera, Seen, Undistorted};
pub use consistency::{Consistency, nees};
#[cfg(feature = "alloc")]
pub use copies::{Copies, Ways};
pub use eskf::{EskfFilter, EskfParams, GaussMarkov, ImuDensities, ImuMean, Start};
#[cfg(feature = "runtime")]
pub use estimator::{
    Course, EskfEstimator, NavigationInputs, NavigationOptions, NavigationOutput, NavigationOutputs,
    NavigationStatus, Verdicts,
};
pub use factor::{Factor, NavigationFactor, Rows};
pub use fused::Fused;
pub use geodesy::{Geodetic, LocalFrame};
pub use history::{Arrivals, History, Placed, Replayed};
pub use measurement::{
    AbsolutePose, BarometricHeight, BodyVelocity, GnssHeading, GnssPosition, GnssVelocity, Height, Linearised,
    MagneticField, MagneticHeading, Measurement, NonHolonomic, RelativePose, WheelSpeed, ZeroRotation,
    ZeroVelocity,
};
pub use numbers::CONFIRMED;
pub use propagate::Propagate;
pub use refusal::Refusal;
#[cfg(feature = "smoother")]
pub use smoother::*;
pub use state::{
    ACCELEROMETER_BIAS, Aided, Complete, Estimate, GYROSCOPE_BIAS, Keyframe, NAVIGATED, NAVIGATION, Navigated,
    Navigation, Optional, POSITION, ROTATION, States, VELOCITY, Vehicle, offset,
};
pub use stream::{Counts, Stream, StreamParams};
pub use track::{Track, TrackPoint};
