//! Orientation from inertial and magnetic sensors.
//!
//! Conventions of every file below:
//!
//! * The world is ENU: x east, y north (magnetic north where a magnetometer gives it), z up.
//! * An orientation is `world_from_body`: it transforms coordinates in the sensor's frame to the world.
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

mod any;
pub mod average;
mod directions;
mod error;
mod filter;
mod filters;
pub mod initial;
mod low_pass;
mod real;
mod rotation;
mod sample;
mod state;

#[cfg(feature = "runtime")]
mod estimator;
#[cfg(test)]
mod laws;

pub use crate::params::ParamsError;
pub use any::{AnyFilter, AnyParams, FilterParams};
pub use error::{ErrorStatistics, OrientationError};
#[cfg(feature = "runtime")]
pub use estimator::{
    Attitude, AttitudeOutput, AttitudeOutputs, AttitudeStatus, Frames, ImuAndMagnetometer, InertialInput,
    InertialInputs,
};
pub use filter::{About, AttitudeFilter};
pub use real::Real;
pub use sample::{ImuSample, MAX_ANGULAR_VELOCITY, MAX_MAGNETIC_FIELD, MAX_SPECIFIC_FORCE, Quantity, SampleError};
pub use state::MAX_GAP_S;

/// The module of each filter, with its types.
macro_rules! modules {
    ($($module:ident $estimator:ident $filter:ident $params:ident;)*) => {
        $(
            pub mod $module;
            pub use $module::{$filter, $params};
        )*
    };
}

crate::attitude_filters!(modules!());
