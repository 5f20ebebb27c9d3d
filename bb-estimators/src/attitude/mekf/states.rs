//! The layout of the error state.

/// The number of states.
pub(super) const STATES: usize = 18;
/// Rotation error, world axes, rad: `R_true = exp(θ) R`.
pub(super) const ROTATION: usize = 0;
/// Error of the gyroscope's bias, body axes, rad/s.
pub(super) const BIAS: usize = 3;
/// Error of the gyroscope's scale and misalignment, a 3×3 matrix row by row, fraction.
pub(super) const CALIBRATION: usize = 6;
/// Horizontal velocity, world axes, m/s: the total value, not an error.
pub(super) const VELOCITY: usize = 15;
/// How much the accelerometer lags the gyroscope, s: the total value, not an error.
pub(super) const FORCE_LATENCY: usize = 17;
