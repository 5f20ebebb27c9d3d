//! What depends on parameters and sample time alone, made when the sample time changes.

use super::VqfParams;
use super::low_pass::Coefficients;
use crate::attitude::low_pass::gain;

/// Coefficients serve sample times that differ from theirs by up to this fraction.
const TOLERANCE: f64 = 1.0 / 64.0;

/// How far a bias wanders within the forgetting time, rad/s: 0.1°/s. Source: section 3.4 of the paper.
const BIAS_WANDER: f64 = 0.1 * DEGREE;

/// rad.
pub(super) const DEGREE: f64 = core::f64::consts::PI / 180.0;

/// For what happens with every sample of gyroscope and accelerometer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InertialCoefficients {
    dt_s: f64,
    pub(super) tilt: Coefficients,
    pub(super) rest: Coefficients,
    /// What is kept of the bias's covariance in a sample, as a factor, and what is added to its variances, (rad/s)².
    pub(super) bias_kept: f64,
    pub(super) bias_growth: f64,
    /// Variances of the bias's measurements, (rad/s)².
    pub(super) rest_variance: f64,
    pub(super) motion_variance: f64,
    pub(super) vertical_variance: f64,
}

impl InertialCoefficients {
    pub(super) fn new(params: &VqfParams, dt_s: f64) -> Self {
        let initial = params.initial_bias * params.initial_bias;
        let growth = BIAS_WANDER * BIAS_WANDER / params.bias_forgetting_time * dt_s;
        // The variance of one measurement for which the filter's own goes to that of the deviation squared.
        let measured = |deviation: f64| {
            let squared = deviation * deviation;
            squared * squared / growth + squared
        };
        let motion_variance = measured(params.motion_bias_deviation);
        Self {
            dt_s,
            tilt: Coefficients::new(params.tilt_time_constant, dt_s),
            rest: Coefficients::new(params.rest_time_constant, dt_s),
            bias_kept: if initial > growth { 1.0 - growth / initial } else { 0.0 },
            bias_growth: growth.min(initial),
            rest_variance: measured(params.rest_bias_deviation),
            motion_variance,
            vertical_variance: motion_variance / params.vertical_forgetting_factor.max(1e-10),
        }
    }

    /// Makes them anew if they are not for this sample time.
    #[inline]
    pub(super) fn follow(&mut self, params: &VqfParams, dt_s: f64) {
        if (dt_s - self.dt_s).abs() > TOLERANCE * self.dt_s {
            *self = Self::new(params, dt_s);
        }
    }
}

/// For what happens with every sample of the magnetometer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FieldCoefficients {
    dt_s: f64,
    pub(super) field: Coefficients,
    pub(super) heading_gain: f64,
    pub(super) reference_gain: f64,
}

impl FieldCoefficients {
    pub(super) fn new(params: &VqfParams, dt_s: f64) -> Self {
        Self {
            dt_s,
            field: Coefficients::new(params.field_time_constant, dt_s),
            heading_gain: gain(dt_s, params.heading_time_constant),
            reference_gain: gain(dt_s, params.reference_time_constant),
        }
    }

    /// Makes them anew if they are not for this sample time.
    #[inline]
    pub(super) fn follow(&mut self, params: &VqfParams, dt_s: f64) {
        if (dt_s - self.dt_s).abs() > TOLERANCE * self.dt_s {
            *self = Self::new(params, dt_s);
        }
    }
}
