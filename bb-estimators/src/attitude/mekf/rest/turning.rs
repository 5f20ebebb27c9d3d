//! Distinguishes rest from a slow and steady rotation.
//!
//! To a gyroscope, such a rotation is a bias. But gravity and the field do not turn in the frame of a body at rest, whatever the
//! offset of the magnetometer, and in the frame of a body that turns at ω both have a trend: `ḟ = -ω × f`. Their linear trends
//! by least squares tell whether the body turns, and their uncertainty which rotations are excluded.

use nalgebra::Vector3;

use super::trend::Trend;
use crate::attitude::Real;
use crate::attitude::initial::MIN_HORIZONTAL_FRACTION;

/// A change of the mean angular velocity by more than this, rad/s, begins another rotation: 0.3°/s, many times the noise of a
/// mean.
const SAME_RATE: f64 = 5e-3;

/// A slower rotation counts as rest, rad/s: 0.14°/s. Gravity and the field drift as well, by temperature and by iron.
const SLOWEST: f64 = 2.4e-3;

/// A rotation is seen if its trend exceeds that by this many standard deviations.
const SEEN: f64 = 4.0;

/// A rotation is excluded if the trend is below a part of it by this many standard deviations: an unknown offset makes the
/// trend of the field seem slower.
const EXCLUDED: f64 = 3.0;
const EXCLUDED_PART: f64 = 0.5;

/// After this time, s, a rotation that has not been seen is excluded: it is below 0.4°/s. A trend that begins later is that of
/// a field that changes.
const OPEN_S: f64 = 4.0;

/// The assumed error of a window's mean specific force, m/s², and of its field, as a fraction of its norm, before any is seen.
const FORCE_ERROR: f64 = 0.02;
const FIELD_ERROR: f64 = 0.003;

/// A field that is off its trend by this many times that error, and by this part of the trend, jumps and does not turn: a step is off
/// by more than half of its trend, an arc of a radian by a sixth.
const JUMP: f64 = 4.0;
const JUMP_PART: f64 = 0.3;

/// The trend of the field may show a rotation about the vertical as faster than it is, by its uncertain offset.
const FASTER: f64 = 1.5;

/// What the trends say of a body whose gyroscope shows a steady rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// A rotation at that rate is excluded.
    Rest,
    /// It could not have been seen yet.
    Open,
    /// It is seen.
    Turning,
}

/// Means over a window in the body frame.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct BodyMeans<T> {
    /// m/s².
    pub(in super::super) force: Vector3<T>,
    /// With the offset.
    pub(in super::super) field: Option<Vector3<T>>,
    /// The offset of the magnetometer, as far as it is known.
    pub(in super::super) offset: Vector3<T>,
}

/// What is known of the gyroscope's bias, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct KnownBias<T> {
    pub(in super::super) mean: Vector3<T>,
    /// Standard deviation of the least known component.
    pub(in super::super) deviation: T,
    /// Standard deviation about the vertical.
    pub(in super::super) vertical_deviation: T,
}

impl<T: Real> KnownBias<T> {
    pub(super) fn none() -> Self {
        Self { mean: Vector3::zeros(), deviation: T::ZERO, vertical_deviation: T::ZERO }
    }
}

/// The trends since the gyroscope's rate has been what it is.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turning<T> {
    /// What was known of the bias when a rotation was last excluded.
    pub(super) bias: KnownBias<T>,
    /// The gyroscope's mean rate when the trends began, rad/s.
    first_rate: Vector3<T>,
    /// How long ago that was, s.
    pub(super) duration: T,
    force: Trend<T>,
    field: Trend<T>,
    last_field: Vector3<T>,
    pub(super) verdict: Verdict,
    /// Of the rotation that the trends show, (rad/s)².
    pub(super) squared_rate: T,
}

impl<T: Real> Turning<T> {
    pub(super) fn new(rate: &Vector3<T>, bias: KnownBias<T>) -> Self {
        Self {
            bias,
            first_rate: *rate,
            duration: T::ZERO,
            force: Trend::new(),
            field: Trend::new(),
            last_field: Vector3::zeros(),
            verdict: Verdict::Open,
            squared_rate: T::ZERO,
        }
    }

    /// Adds a window of `dt` seconds, at the end of which the gyroscope's mean rate is `rate`, rad/s, and its bias known as
    /// `bias`.
    pub(super) fn add(&mut self, dt: T, rate: &Vector3<T>, means: &BodyMeans<T>, bias: KnownBias<T>) {
        if (rate - self.first_rate).norm_squared() > T::of(SAME_RATE * SAME_RATE) {
            *self = Self::new(rate, self.bias);
        }
        let Some(up) = means.force.try_normalize(T::ZERO) else { return };
        self.duration += dt;
        let excess = rate - self.bias.mean;
        let about_vertical = excess.dot(&up).abs();
        let about_level = (excess - up * excess.dot(&up)).norm();

        self.force.add(dt, Some(&means.force));
        let tilting = Speed::new(&self.force, T::of(FORCE_ERROR), &up, means.force.norm_squared());
        // What turns faster than the body can is something else.
        let unknown = T::of(3.0) * self.bias.deviation;
        let mut is_seen = tilting.is_seen() && tilting.is_slower(about_level + unknown);
        let mut is_open = !tilting.excludes(about_level);
        self.squared_rate = tilting.squared;

        self.field.add(dt, means.field.as_ref());
        self.last_field = means.field.unwrap_or(self.last_field);
        let squared_norm = self.last_field.norm_squared();
        // Without a field, rest is more probable than a steady rotation about the vertical.
        if squared_norm > T::ZERO {
            let field = self.last_field - means.offset;
            let horizontal = (field - up * up.dot(&field)).norm_squared();
            let least = T::of(MIN_HORIZONTAL_FRACTION * MIN_HORIZONTAL_FRACTION) * squared_norm;
            let error = T::of(FIELD_ERROR) * squared_norm.sqrt();
            let turning = Speed::new(&self.field, error, &up, horizontal.max(least));
            // The biases of the three axes are alike.
            let unknown = (T::of(3.0) * self.bias.vertical_deviation).min(T::TWO * about_level + T::of(SLOWEST));
            let is_slower = turning.is_slower(T::of(FASTER) * about_vertical + unknown);
            is_seen |= turning.is_steady && turning.is_seen() && is_slower;
            is_open |= !turning.excludes(about_vertical);
            self.squared_rate += turning.squared;
        }
        is_open &= self.duration < T::of(OPEN_S);
        self.verdict = match (is_seen, is_open) {
            (true, _) => Verdict::Turning,
            (false, true) => Verdict::Open,
            (false, false) => Verdict::Rest,
        };
        if self.verdict == Verdict::Rest {
            self.bias = bias;
        }
    }
}

/// How fast a vector turns about one that is vertical to it, by its trend.
struct Speed<T> {
    /// (rad/s)².
    squared: T,
    /// rad/s.
    deviation: T,
    /// Whether the trend is that of a steady rotation.
    is_steady: bool,
}

impl<T: Real> Speed<T> {
    /// `error` is the assumed one of a value, and `squared_arm` the square of that part of the vector that the rotation moves.
    fn new(trend: &Trend<T>, error: T, up: &Vector3<T>, squared_arm: T) -> Self {
        let line = trend.line(error);
        let across = line.slope - up * up.dot(&line.slope);
        Self {
            squared: across.norm_squared() / squared_arm,
            deviation: (line.variance / squared_arm).sqrt(),
            is_steady: line.squared_error
                < T::of(JUMP * JUMP) * error * error + T::of(JUMP_PART * JUMP_PART) * line.squared_rise,
        }
    }

    fn is_seen(&self) -> bool {
        let least = T::of(SLOWEST) + T::of(SEEN) * self.deviation;
        self.squared > least * least
    }

    fn is_slower(&self, rate: T) -> bool {
        self.squared < rate * rate
    }

    /// Whether there is no rotation at this rate, rad/s, or none that matters.
    fn excludes(&self, rate: T) -> bool {
        let most = (self.squared.sqrt() + T::of(EXCLUDED * EXCLUDED_PART) * self.deviation) / T::of(EXCLUDED_PART);
        rate < T::of(SLOWEST) || rate > most
    }
}
