//! Whether the sensor lies still, and what the gyroscope reads then.

use nalgebra::Vector3;

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

/// How long all this has to hold, s. VQF waits 1.5 s.
const LEAST_S: f64 = 1.0;

/// Recognises rest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rest {
    /// Mean angular velocity, rad/s.
    pub(super) rate: Vector3<f64>,
    force: Vector3<f64>,
    still_s: f64,
}

impl Rest {
    pub(super) fn new(rate: &Vector3<f64>, force: &Vector3<f64>) -> Self {
        Self { rate: *rate, force: *force, still_s: 0.0 }
    }

    /// Takes a sample; the bias is known up to `bias_deviation`, rad/s.
    pub(super) fn add(
        &mut self,
        dt: f64,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
        bias: &Vector3<f64>,
        bias_deviation: f64,
    ) {
        let gain = (dt / TIME_CONSTANT_S).min(1.0);
        self.rate += (rate - self.rate) * gain;
        self.force += (force - self.force) * gain;
        let rate_is_steady = (rate - self.rate).norm_squared() < MAX_RATE_DEVIATION * MAX_RATE_DEVIATION;
        let force_is_steady = (force - self.force).norm_squared() < MAX_FORCE_DEVIATION * MAX_FORCE_DEVIATION;
        let step = MAX_BIAS_STEP + 3.0 * bias_deviation;
        let rate_is_bias = (self.rate - bias).norm_squared() < step * step;
        let force_is_gravity = (self.force.norm() - super::GRAVITY).abs() < MAX_GRAVITY_ERROR;
        let still = rate_is_steady && force_is_steady && rate_is_bias && force_is_gravity;
        self.still_s = if still { (self.still_s + dt).min(1e3) } else { 0.0 };
    }

    pub(super) fn is_detected(&self) -> bool {
        self.still_s > LEAST_S
    }
}
