//! An extended Kalman filter for robots that drive on a plane.
//!
//! Estimates position, heading and velocity from a gyroscope and wheels, corrected by satellite navigation, headings and poses.
//! It also estimates the gyroscope bias and the wheel scale. It needs a quarter of the work of [`EskfFilter`](super::EskfFilter) and no
//! accelerometer, and it starts while the robot moves. It cannot handle slopes: the world is flat, and the body upright.
//!
//! S. Thrun, W. Burgard, D. Fox, "Probabilistic Robotics", 2005, section 5.3 (motion on an arc); P. D. Groves, "Principles of GNSS,
//! Inertial, and Multisensor Integrated Navigation Systems", 2nd edition, 2013, chapter 3 and section 16.3.
//!
//! # States
//!
//! | index | quantity | unit |
//! |---|---|---|
//! | [`POSITION`], 2 | of the body's origin, in the world: x east, y north | m |
//! | [`HEADING`] | of the body's x axis, from the world's counter-clockwise | rad |
//! | [`VELOCITY`], 2 | of the body's origin, in the body: x forward, y left | m/s |
//! | [`GYROSCOPE_BIAS`] | reading of the gyroscope minus the yaw rate | rad/s |
//! | [`WHEEL_SCALE`] | scale of the wheels' velocity, less 1 | |
//!
//! An error is the truth minus the estimate. Wheels correct the filter rather than drive it: they may slip, stall or report late,
//! and their scale is known no better than the tyre pressure.
//!
//! ```
//! use bb_estimators::navigation::planar::{PlanarFilter, PlanarParams, PlanarPosition, PlanarStart, WheelVelocity};
//! use bb_estimators::navigation::{ImuMean, Stream};
//! use nalgebra::{Vector2, Vector3};
//!
//! let mut filter = PlanarFilter::new(PlanarParams::default())?;
//! let (mut wheels, mut gnss) = (Stream::default(), Stream::default());
//! filter.start(&PlanarStart::at(0, (Vector2::zeros(), 2.0), (0.0, 0.1), (Vector2::new(1.0, 0.0), 0.1)))?;
//! for i in 1..=500 {
//!     // Of a sample, the rotation about z counts.
//!     let (angular_velocity, specific_force) = (Vector3::zeros(), Vector3::zeros());
//!     filter.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force })?;
//!     filter.update(&mut wheels, &WheelVelocity::new(Vector2::new(1.0, 0.0), 0.05))?;
//! }
//! filter.update(&mut gnss, &PlanarPosition::new(Vector2::new(5.0, 0.0), 0.5))?;
//! let estimate = filter.estimate().ok_or("the filter has started")?;
//! assert!((estimate.position.x - 5.0).abs() < 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod arc;
#[cfg(feature = "alloc")]
mod copies;
mod estimate;
#[cfg(feature = "runtime")]
mod estimator;
mod filter;
mod measurement;
mod params;
mod propagation;
#[cfg(test)]
mod tests;

pub use estimate::{GYROSCOPE_BIAS, HEADING, POSITION, PlanarEstimate, STATES, VELOCITY, WHEEL_SCALE};
#[cfg(feature = "runtime")]
pub use estimator::{PlanarEstimator, PlanarInputs, PlanarOptions, PlanarOutput, PlanarOutputs, PlanarStatus};
pub use filter::{PlanarFilter, PlanarStart};
pub use measurement::{PlanarHeading, PlanarMeasurement, PlanarPose, PlanarPosition, WheelVelocity, YawRate};
pub use params::PlanarParams;
