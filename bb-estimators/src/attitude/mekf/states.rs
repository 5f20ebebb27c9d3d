//! What the filter estimates: where each state begins in the error state.

/// How many numbers the filter estimates.
pub(super) const STATES: usize = 18;
/// Rotation error, world axes, rad: `R_true = exp(θ) R`.
pub(super) const ROTATION: usize = 0;
/// Error of the gyroscope's bias, body axes, rad/s.
pub(super) const BIAS: usize = 3;
/// Error of the gyroscope's scale and misalignment, a 3×3 matrix row by row, fraction.
pub(super) const CALIBRATION: usize = 6;
/// Horizontal velocity, world axes, m/s: the whole of it, not an error.
pub(super) const VELOCITY: usize = 15;
/// How much the accelerometer lags the gyroscope, s: the whole of it, not an error.
pub(super) const FORCE_LATENCY: usize = 17;
