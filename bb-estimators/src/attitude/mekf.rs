//! A self-calibrating multiplicative error-state Kalman filter, with six axes or nine.
//!
//! F. L. Markley, "Attitude error representations for Kalman filtering", Journal of Guidance, Control, and
//! Dynamics 26(2), 2003, for the error state; D. Laidig, T. Seel, "VQF: Highly accurate IMU orientation estimation
//! with bias estimation and magnetic disturbance rejection", Information Fusion 91, 2023, for what to expect of
//! sensors, and for rest and disturbances. `docs/attitude-filter.md` has the ablations and the comparison.
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
//! `Ṙ = R [ω_true]×` with every sample. In the world frame `θ̇ = -R (δb + δE ω)` has no transition of θ by itself,
//! so over a window of some samples the errors' transition is nothing but the sums of `R`, `R ⊗ ω` and `R f`; it is
//! exact, however fast the rotation, and the covariance moves once a window.
//!
//! # Tilt
//!
//! `v̇ = R f - g`, hence `δv̇ = θ × R f`. A body does not accelerate forever: its velocity is zero up to a deviation
//! that lasts for some time T; in windows of dt, a white error of variance `2 σ² T / dt` has the same effect. So
//! accelerations count for as little as their mean does, where a low-pass of the specific force counts them all
//! up to its time constant. The deviation grows with the accelerations of late; at rest it is next to nothing.
//!
//! # Heading
//!
//! The angle of the field to north, less the magnetometer's offset and lag, which least squares beside the filter give;
//! see `iron.rs`. It observes θ about the vertical, and tilt by the field's slope. Its error is a disturbance that lasts as
//! long as the body takes to pass it, and is as large as the field's norm and dip show; see `field.rs`.
//!
//! # Work
//!
//! What a window says is taken as scalars, one with each sample of the next window, and the mean of the errors
//! corrects the orientation at its end: updates of one row of the covariance each, no matrix is inverted, and no
//! sample takes long.

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

/// Standard deviation of the tilt that one accelerometer sample shows in motion, rad. At rest it is forgotten
/// within a second.
const INITIAL_TILT: f64 = 0.35;
