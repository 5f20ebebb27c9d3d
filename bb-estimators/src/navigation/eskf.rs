//! An error-state Kalman filter for position, velocity and attitude.
//!
//! J. Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508, 2017; P. D. Groves, "Principles of
//! GNSS, Inertial, and Multisensor Integrated Navigation Systems", 2nd edition, 2013, chapters 5 and 14.
//!
//! # States
//!
//! Errors are what truth is more than the estimate. Position and velocity are those of the IMU, in the world; the
//! rotation error is one of the world, `R_true = exp(θ) R`; biases are in the body. Then nothing of the filter depends on
//! how the sensor is mounted, nor on the world's heading or origin, and between two samples no error has a transition of its
//! own: see `propagation.rs`, which has the equations. [`Optional`](super::Optional) states follow, by type.
//!
//! # Update
//!
//! A measurement of several numbers is decomposed once, `H P Hᵀ + R = L Lᵀ`, for its normalised innovation squared and for
//! the update `P - Wᵀ W` with `W = L⁻¹ H P`, which is that of one scalar after the other. The covariance is symmetric to
//! the last bit.
//!
//! Two bounds keep rounding from breaking it. The noise of a scalar is taken as at least 1e-10 of its predicted variance, and as
//! 1e-13 of the variances that its terms have by themselves. A Cholesky decomposition checks the covariance every 1024 updates,
//! and at once after an update that leaves less than 1e-8 of a variance, after a gap, and while the filter is lost (a position
//! known to 100 km). [`Eskf::repairs`] counts what it found. Variances are bounded, see `layout.rs`, and a correction by more than
//! anything on the Earth can be off is refused as [`Refusal::OutOfRange`](super::Refusal).

mod elsewhere;
mod filter;
mod params;
mod propagation;
mod sample;
mod start;
#[cfg(test)]
mod tests;

pub use filter::Eskf;
#[cfg(feature = "runtime")]
pub(crate) use params::imu_params;
pub use params::{EskfParams, GaussMarkov, ImuDensities};
#[cfg(feature = "smoother")]
pub(super) use propagation::{Transition, rows};
pub use sample::ImuMean;
pub(super) use sample::{LONGEST_GAP_S, seconds_between};
pub use start::Start;
