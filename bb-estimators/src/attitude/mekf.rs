//! A self-calibrating multiplicative error-state Kalman filter, with six axes or nine.
//!
//! F. L. Markley, "Attitude error representations for Kalman filtering", Journal of Guidance, Control, and Dynamics
//! 26(2), 2003, for the error state; D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation with bias
//! estimation and magnetic disturbance rejection", Information Fusion 91, 2023, for typical sensor errors, and for
//! rest and disturbances. `docs/attitude-filter.md` has the ablations and the comparison.
//!
//! # State
//!
//! With `R` from body to world, ω the measured angular velocity, f the specific force:
//!
//! * θ, the rotation error in the world: `R_true = exp(θ) R`,
//! * b and E, the gyroscope's bias and its scale and misalignment: `ω_true = ω - b - E ω`,
//! * v, the horizontal velocity,
//! * the latency of the accelerometer relative to the gyroscope.
//!
//! # Prediction
//!
//! `Ṙ = R [ω_true]×` with every sample. In the world frame, `θ̇ = -R (δb + δE ω)` has no transition of θ itself. Over
//! a window of some samples, the errors' transition therefore consists only of the sums of `R`, `R ⊗ ω` and `R f`. It
//! is exact, however fast the rotation, and the covariance is propagated once per window.
//!
//! # Tilt
//!
//! `v̇ = R f - g`, hence `δv̇ = θ × R f`. A body does not accelerate forever: its velocity is zero up to a deviation
//! that lasts for some time T. In windows of dt, a white error of variance `2 σ² T / dt` has the same effect. So
//! accelerations count only by their mean, while a low-pass of the specific force counts them all up to its time
//! constant. The deviation grows with recent accelerations; at rest it is almost zero.
//!
//! # Heading
//!
//! The angle of the field to north, corrected for the magnetometer's offset and lag, which least squares beside the
//! filter estimate; see `iron.rs`. It observes θ about the vertical, and tilt through the field's slope. Its error is
//! a disturbance that lasts as long as the body takes to pass it. Its size follows from the field's norm and dip; see
//! `field.rs`.
//!
//! # Work
//!
//! The measurements of a window are fused as scalars, one with each sample of the next window, and the mean of the
//! errors corrects the orientation at its end. Each update uses one row of the covariance, no matrix is inverted, and
//! no sample takes long.

mod errors;
mod field;
mod filter;
mod iron;
mod measurement;
mod params;
mod rest;
mod states;
#[cfg(test)]
mod tests;
mod vertical;
mod window;

pub use filter::MekfFilter;
pub use params::MekfParams;

/// What the filter is for.
pub const ABOUT: super::About = super::About {
    when: "first choice: the most accurate from rest and in motion, without calibration, with a covariance",
    idea: "an error-state Kalman filter that also finds the gyroscope's bias, scale and misalignment, and the magnetometer's offset and lag",
};

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;

/// Standard deviation of the tilt from one accelerometer sample in motion, rad. At rest it is forgotten within a
/// second.
const INITIAL_TILT: f64 = 0.35;
