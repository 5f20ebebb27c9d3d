//! Orientation from inertial and magnetic sensors.
//!
//! Conventions of every file below:
//!
//! * The world is ENU: x east, y north (magnetic north where a magnetometer gives it), z up.
//! * An orientation is `world_from_body`: it takes coordinates in the sensor's frame to the world.
//! * An accelerometer measures specific force: at rest it reads one g upwards.
//! * Algorithms compute with a scalar [`Real`], `f64` where none is named: `MadgwickFilter` is `MadgwickFilter<f64>`, and
//!   `MadgwickFilter<f32>` takes an `ImuSample<f32>`. Stamps are nanoseconds and parameters are `f64` with both.
//!
//! ```
//! use bb_estimators::attitude::{AttitudeFilter, ImuSample, MadgwickFilter, MadgwickParams};
//! use nalgebra::Vector3;
//!
//! let mut filter = MadgwickFilter::new(MadgwickParams::default())?;
//! filter.update(&ImuSample {
//!     time_ns: 0,
//!     angular_velocity: Vector3::zeros(),
//!     specific_force: Vector3::new(0.0, 0.0, 9.81),
//!     magnetic_field: Some(Vector3::new(0.0, 20e-6, -45e-6)),
//! })?;
//! let orientation = filter.world_from_body().expect("the first sample starts the filter");
//! assert!(orientation.angle() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod average;
pub mod complementary;
mod directions;
mod error;
mod filter;
pub mod fusion;
pub mod initial;
mod low_pass;
pub mod madgwick;
pub mod mahony;
pub mod mekf;
pub(crate) mod params;
mod real;
mod rotation;
mod sample;
mod state;
pub mod tilt;
pub mod vqf;

#[cfg(feature = "runtime")]
mod estimator;
#[cfg(test)]
mod laws;

pub use complementary::{ComplementaryFilter, ComplementaryParams};
pub use error::{ErrorStatistics, OrientationError};
#[cfg(feature = "runtime")]
pub use estimator::{
    Attitude, AttitudeOutput, AttitudeOutputs, AttitudeStatus, Frames, ImuAndMagnetometer, InertialInput,
    InertialInputs,
};
pub use filter::AttitudeFilter;
pub use fusion::{FusionFilter, FusionParams};
pub use madgwick::{MadgwickFilter, MadgwickParams};
pub use mahony::{MahonyFilter, MahonyParams};
pub use mekf::{MekfFilter, MekfParams};
pub use params::ParamsError;
pub use real::Real;
pub use sample::{ImuSample, MAX_ANGULAR_VELOCITY, MAX_MAGNETIC_FIELD, MAX_SPECIFIC_FORCE, Quantity, SampleError};
pub use state::MAX_GAP_S;
pub use tilt::{TiltFilter, TiltParams};
pub use vqf::{VqfFilter, VqfParams};
