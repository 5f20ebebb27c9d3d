//! Detects rest, and averages the gyroscope's readings during it.

mod trend;
mod turning;

use nalgebra::Vector3;

use crate::attitude::Real;
pub(super) use turning::{BodyMeans, KnownBias};
use turning::{Turning, Verdict};

/// Time constant of the means, s. Source: VQF's `restFilterTau`.
const TIME_CONSTANT_S: f64 = 0.5;

/// How far the angular velocity may be from its mean, rad/s: 2°/s, VQF's `restThGyr`.
const MAX_RATE_DEVIATION: f64 = 0.035;

/// How far the specific force may be from its mean, m/s². Source: VQF's `restThAcc`.
const MAX_FORCE_DEVIATION: f64 = 0.5;

/// How far the mean specific force may be from gravity, m/s²: an accelerometer without calibration.
const MAX_GRAVITY_ERROR: f64 = 1.0;

/// A mean angular velocity beyond the bias by more than this, rad/s, is a rotation: 2°/s, VQF's `biasClip`.
const MAX_BIAS_STEP: f64 = 0.035;

/// How long all these conditions must hold, s. VQF waits 1.5 s.
const LEAST_S: f64 = 1.0;

/// Detects rest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rest<T> {
    /// Mean angular velocity, rad/s.
    pub(super) rate: Vector3<T>,
    force: Vector3<T>,
    still_s: T,
    turning: Turning<T>,
}

/// A rotation that was taken for rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Missed<T> {
    /// What was known of the bias before.
    pub(super) bias: KnownBias<T>,
    /// The square of its angle so far, rad².
    pub(super) squared_angle: T,
}

impl<T: Real> Rest<T> {
    pub(super) fn new(rate: &Vector3<T>, force: &Vector3<T>) -> Self {
        Self { rate: *rate, force: *force, still_s: T::ZERO, turning: Turning::new(rate, KnownBias::none()) }
    }

    /// Adds a sample; the bias is known up to `bias_deviation`, rad/s.
    pub(super) fn add(
        &mut self,
        dt: T,
        rate: &Vector3<T>,
        force: &Vector3<T>,
        bias: &Vector3<T>,
        bias_deviation: T,
    ) {
        let gain = (dt / T::of(TIME_CONSTANT_S)).min(T::ONE);
        self.rate += (rate - self.rate) * gain;
        self.force += (force - self.force) * gain;
        let rate_is_steady = (rate - self.rate).norm_squared() < T::of(MAX_RATE_DEVIATION * MAX_RATE_DEVIATION);
        let force_is_steady =
            (force - self.force).norm_squared() < T::of(MAX_FORCE_DEVIATION * MAX_FORCE_DEVIATION);
        // What this rest has taught is no reason to end it.
        let has_begun = self.still_s > T::ZERO && self.turning.duration > T::ZERO;
        let before = &self.turning.bias;
        let (bias, bias_deviation) =
            if has_begun { (&before.mean, before.deviation) } else { (bias, bias_deviation) };
        let step = T::of(MAX_BIAS_STEP) + T::of(3.0) * bias_deviation;
        let rate_is_bias = (self.rate - bias).norm_squared() < step * step;
        let force_is_gravity = (self.force.norm() - T::of(super::GRAVITY)).abs() < T::of(MAX_GRAVITY_ERROR);
        let still = rate_is_steady && force_is_steady && rate_is_bias && force_is_gravity;
        self.still_s = if still { (self.still_s + dt).min(T::of(1e3)) } else { T::ZERO };
    }

    /// Adds the means of a window of `dt` seconds, at the end of which the bias is known as `bias`.
    pub(super) fn observe(&mut self, dt: T, means: &BodyMeans<T>, bias: KnownBias<T>) -> Option<Missed<T>> {
        if self.still_s <= T::ZERO || self.turning.duration <= T::ZERO {
            self.turning = Turning::new(&self.rate, bias);
        }
        if self.still_s <= T::ZERO {
            return None;
        }
        let was_detected = self.is_detected();
        self.turning.add(dt, &self.rate, means, bias);
        let Turning { bias, squared_rate, duration, .. } = &self.turning;
        let missed = Missed { bias: *bias, squared_angle: *squared_rate * *duration * *duration };
        (was_detected && !self.is_detected()).then_some(missed)
    }

    /// Whether the body is at rest, as far as is known: most bodies that are still for a second are.
    pub(super) fn is_detected(&self) -> bool {
        self.is_steady() && self.turning.verdict != Verdict::Turning
    }

    /// Whether a slow rotation is excluded.
    pub(super) fn is_certain(&self) -> bool {
        self.turning.verdict == Verdict::Rest
    }

    fn is_steady(&self) -> bool {
        self.still_s > T::of(LEAST_S)
    }
}
