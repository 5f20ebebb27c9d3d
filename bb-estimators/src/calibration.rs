//! Calibration of inertial sensors from their measurements: offsets, scale and misalignment.
//!
//! D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to implement method for IMU calibration without external
//! equipments", ICRA 2014, for the accelerometer from rests in several poses; M. Kok, T. B. Schön, "Magnetometer calibration
//! using inertial sensors", IEEE Sensors Journal 16(14), 2016, section II, for the magnetometer's model.
//!
//! Both sensors measure a vector of constant norm `r`, gravity or the Earth's field, in many directions:
//!
//! `‖M (x - b)‖ = r`
//!
//! with the measurements x, the offset b, and the matrix M of scale and misalignment. The norm does not depend on a
//! rotation of all measurements, so M has six numbers: it is upper triangular for the accelerometer, whose x axis is
//! then the body's, and symmetric for the magnetometer.
//!
//! ```
//! use bb_estimators::calibration::{Rests, RestParams, accelerometer};
//! use bb_estimators::attitude::ImuSample;
//!
//! let mut rests = Rests::new(RestParams::default())?;
//! let mut found = Vec::new();
//! // Six poses of three seconds, each axis up and down, of a sensor that reads 0.1 m/s² too much along x.
//! for (pose, axis) in [0, 0, 1, 1, 2, 2].into_iter().enumerate() {
//!     for i in 0..300_i64 {
//!         let mut force = [0.0; 3];
//!         force[axis] = if pose % 2 == 0 { 9.81 } else { -9.81 };
//!         force[0] += 0.1;
//!         found.extend(rests.add(&ImuSample {
//!             time_ns: (300 * pose as i64 + i) * 10_000_000,
//!             angular_velocity: [0.0; 3].into(),
//!             specific_force: force.into(),
//!             magnetic_field: None,
//!         }));
//!     }
//! }
//! found.extend(rests.finish());
//! let fit = accelerometer(&found, 9.81)?;
//! assert!((fit.calibration.offset.x - 0.1).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`sensor_noise`] estimates white noise, bias instability and random walk of a sensor at rest, by its Allan
//! deviation.
//!
//! It builds without the standard library and does not allocate; code that collects rests, fields and samples does.

mod allan;
mod ellipsoid;
mod error;
#[cfg(feature = "runtime")]
mod estimator;
mod inertial;
mod linear;
mod magnetic;
mod rest;
#[cfg(test)]
mod tests;

pub use allan::{AllanCurve, AllanError, AllanPoint, Known, SensorNoise, allan_deviation, integrate, sensor_noise};
pub use error::CalibrationError;
#[cfg(feature = "runtime")]
pub use estimator::{Calibrate, Calibrated, CalibratedOptions};
pub use inertial::{AccelerometerFit, GyroscopeFit, Model, accelerometer, gyroscope};
pub use linear::Linear;
pub use magnetic::{MagnetometerFit, magnetometer};
pub use rest::{Rest, RestParams, Rests};
