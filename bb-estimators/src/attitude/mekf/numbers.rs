//! All numbers of the filter, each with its unit and its reason. `book/src/laboratory/attitude.md` has the ablation: the errors without
//! a part, or with another value.

use core::f64::consts::PI;

const DEGREE: f64 = PI / 180.0;

// The gyroscope.

/// White noise, rad/√s: ten times that of a data sheet, for the bandwidth and the vibration of a body that moves.
pub(super) const GYROSCOPE_NOISE: f64 = 1e-3;
/// Error per root of turned angle and rate, √s: scale and misalignment of 0.1 to 1 %, and the sampling of a changing rate.
pub(super) const TURN_NOISE: f64 = 1e-2;
/// Standard deviation of the bias at the start, rad/s: 1.1°/s, for an uncalibrated sensor.
pub(super) const INITIAL_BIAS: f64 = 2e-2;
/// Growth of the bias, rad/s/√s: 0.1°/s in an hour.
pub(super) const BIAS_DRIFT: f64 = 3e-5;

// How bodies move.

/// Horizontal velocity of any body beyond the velocity and the acceleration it has shown, m/s: a hand that moves slowly.
pub(super) const VELOCITY_OF_ALL: f64 = 0.15;
/// Duration of a velocity, s: a step.
pub(super) const VELOCITY_LASTS_S: f64 = 1.0;
/// Duration of an acceleration, s, before the opposite one follows.
pub(super) const ACCELERATION_LASTS_S: f64 = 0.2;
/// Standard deviation of the velocity at the start, m/s: a pedestrian.
pub(super) const INITIAL_VELOCITY: f64 = 1.0;
/// Variance of an unknown angle, rad²: uniform on the circle.
pub(super) const ANY_ANGLE: f64 = 3.0;
/// Cosine of the largest angle between the vertical and the mean specific force of some seconds: 45°, a horizontal
/// acceleration of 1 g.
pub(super) const OVERTURNED: f64 = 0.7;
/// Standard deviation of the mean specific force of some seconds, m/s²: the accelerometer's bias, and accelerations that do not
/// cancel.
pub(super) const MEAN_FORCE: f64 = 1.0;
/// Standard gravity, m/s².
pub(super) const GRAVITY: f64 = 9.80665;

// Memory.

/// Shortest memory, s: a disturbance that the body has passed, an angular velocity, the shaking before rest.
pub(super) const BRIEF_S: f64 = 0.3;
/// Memory of some seconds, s.
pub(super) const SHORT_S: f64 = 5.0;
/// Longest memory, s.
pub(super) const LONG_S: f64 = 20.0;
/// Length of a window, s: at most, a hand turns by a tenth of a radian in it.
pub(super) const WINDOW_S: f64 = 0.03;

// Doubt.

/// Number of standard deviations beyond which a deviation is an outlier, and of mean periods beyond which a time between
/// samples is a gap.
pub(super) const OUTLIER: f64 = 4.0;
/// Weight of a sample in the mean period.
pub(super) const PERIOD_GAIN: f64 = 0.0625;
/// Standard deviation of an orientation from one sample in motion, rad.
pub(super) const UNKNOWN: f64 = 1.0;

// Rest, as VQF detects it.

/// Time for which a sensor must be still, s.
pub(super) const REST_TIME_S: f64 = 1.5;
/// The angular velocity that is still, beyond the bias and from its own mean, rad/s.
pub(super) const REST_RATE: f64 = 2.0 * DEGREE;
/// The change of the specific force that is still, m/s².
pub(super) const REST_FORCE: f64 = 0.5;
/// Standard deviation of the bias from the mean of a second at rest, rad/s.
pub(super) const REST_BIAS: f64 = 2e-3;

// The field.

/// Standard deviation of the heading from a second of the field, rad: 14°, since errors of a place last longer.
pub(super) const HEADING_NOISE: f64 = 0.245;
/// Growth of [`HEADING_NOISE`] with the distance of norm and dip from the reference, as a fraction of the norm.
pub(super) const DISTURBANCE: f64 = 2.45;
/// Standard deviation of the magnetometer's lag relative to the gyroscope, s: a period at 66 Hz.
pub(super) const MAGNETOMETER_LAG: f64 = 0.015;
/// Fields whose norm and dip differ by less than this fraction are the same.
pub(super) const SAME_FIELD: f64 = 0.1;
/// The angular velocity of a body that leaves its place, rad/s.
pub(super) const FAST: f64 = 20.0 * DEGREE;
/// Smallest error that contradicts the heading, if the field shows it for seconds, rad.
pub(super) const CONTRADICTION: f64 = 0.9;
/// Standard deviation up to which a heading is trusted, rad: 10°.
pub(super) const TRUSTED: f64 = 0.175;

/// The largest error of a field that goes with how the body turns, as a fraction of it, 1/rad: the axes of an uncalibrated magnetometer, and
/// the scale of a gyroscope.
pub(super) const WITH_TURNS: f64 = 0.02;

// The offset of the magnetometer, in units of the field.

/// Degrees of freedom of Student's distribution of the field's steps from pose to pose.
pub(super) const TAILS: f64 = 4.0;
/// Standard deviation of an offset, if there is one: several times the field, as from iron in a phone.
pub(super) const ANY_OFFSET: f64 = 4.2;
/// Standard deviation of the offset that remains after a calibration: 1.5 µT.
pub(super) const CALIBRATED: f64 = 0.03;
/// Standard deviation of an apparent offset, from changes of the field between places where the body turns as it moves: 1 µT.
pub(super) const PLACES: f64 = 0.02;
/// Initial scale of the steps and of the magnetometer's errors: 3 µT.
pub(super) const FIELD_WALK: f64 = 0.0625;
/// The least scale: 0.5 µT.
pub(super) const LEAST_WALK: f64 = 0.01;
/// Number of poses that the first scale counts for.
pub(super) const FIRST_POSES: f64 = 5.0;
/// Turn from pose to pose, rad.
pub(super) const POSE_TURN: f64 = 0.07;
/// Total turn after which the norm of the field is known, rad.
pub(super) const SCALE_TURN: f64 = 0.1;
/// Logarithm of the odds against an offset at the start.
pub(super) const ODDS: f64 = 5.0;
/// Logarithm of the odds against another offset later: magnets that pass are many, magnets that stay are few.
pub(super) const LATER_ODDS: f64 = 100.0;
/// Number of poses after which a newcomer that is not about to win restarts: 35 rad.
pub(super) const NEWCOMER_POSES: f64 = 500.0;
/// Ratio to which the deviation of the offset falls before the heading from the previous one is doubted.
pub(super) const SHARPER: f64 = 0.4;
