//! An error-state Kalman filter for position, velocity and attitude.
//!
//! J. Solà, "Quaternion kinematics for the error-state Kalman filter", arXiv 1711.02508, 2017; P. D. Groves, "Principles of
//! GNSS, Inertial, and Multisensor Integrated Navigation Systems", 2nd edition, 2013, chapters 5 and 14.
//!
//! # States
//!
//! An error is the truth minus the estimate. Position and velocity are those of the IMU, in the world. The rotation error is in
//! the world frame, `R_true = exp(θ) R`; biases are in the body frame. The filter is therefore independent of the sensor's
//! mounting and of the world's heading and origin, and the rotation error has no transition of its own between samples. See
//! `propagation.rs` for the equations. [`Optional`](super::Optional) states follow, by type.
//!
//! # Update
//!
//! A measurement with several components is decomposed once, `H P Hᵀ + R = L Lᵀ`. The decomposition serves both the normalised
//! innovation squared and the update `P - Wᵀ W` with `W = L⁻¹ H P`, which equals a sequence of scalar updates. The covariance is
//! exactly symmetric.
//!
//! Two bounds limit the effect of rounding. The noise of a scalar is at least 1e-10 of its predicted variance, and at least 1e-13
//! of the variances of its individual terms. A Cholesky decomposition checks the covariance every 1024 updates. It also checks
//! after an update that leaves less than 1e-8 of a variance, after a gap, and while the filter is lost (a position known to 100
//! km). [`EskfFilter::repairs`] counts the repairs. Variances are bounded, see `layout.rs`. A correction larger than any possible error
//! on the Earth is rejected as [`Refusal::OutOfRange`](super::Refusal).

mod elsewhere;
mod filter;
mod params;
mod propagation;
mod sample;
mod start;
#[cfg(test)]
pub(super) mod tests;
mod transport;

pub(super) use filter::Doubt;
pub use filter::EskfFilter;
pub(crate) use params::imu_params;
pub use params::{EskfParams, GaussMarkov, ImuDensities};
pub(super) use propagation::{Transition, rows};
pub use sample::ImuMean;
pub(super) use sample::seconds_between;
pub use start::Start;
