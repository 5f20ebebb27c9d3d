//! Coefficients that depend only on parameters and sample time, recomputed when the sample time changes.

use super::low_pass::Coefficients;
use super::{DEGREE, VqfParams};
use crate::attitude::Real;
use crate::attitude::low_pass::gain;

/// Coefficients are used for sample times that differ from theirs by up to this fraction.
const TOLERANCE: f64 = 1.0 / 64.0;

/// Distance that a bias wanders within the forgetting time, rad/s: 0.1°/s. Source: section 3.4 of the paper.
const BIAS_WANDER: f64 = 0.1 * DEGREE;

/// Coefficients for every sample of gyroscope and accelerometer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InertialCoefficients<T> {
    dt_s: T,
    pub(super) tilt: Coefficients<T>,
    pub(super) rest: Coefficients<T>,
    /// The factor by which the bias's covariance fades in a sample, and the addition to its variances, (rad/s)².
    pub(super) bias_kept: T,
    pub(super) bias_growth: T,
    /// Variances of the bias's measurements, (rad/s)².
    pub(super) rest_variance: T,
    pub(super) motion_variance: T,
    pub(super) vertical_variance: T,
}

impl<T: Real> InertialCoefficients<T> {
    pub(super) fn new(params: &VqfParams, dt_s: T) -> Self {
        let initial = T::of(params.initial_bias * params.initial_bias);
        let growth = T::of(BIAS_WANDER * BIAS_WANDER) / T::of(params.bias_forgetting_time) * dt_s;
        // The variance of one measurement for which the filter's own goes to that of the deviation squared.
        let measured = |deviation: T| {
            let squared = deviation * deviation;
            squared * squared / growth + squared
        };
        let motion_variance = measured(T::of(params.motion_bias_deviation));
        Self {
            dt_s,
            tilt: Coefficients::new(T::of(params.tilt_time_constant), dt_s),
            rest: Coefficients::new(T::of(params.rest_time_constant), dt_s),
            bias_kept: if initial > growth { T::ONE - growth / initial } else { T::ZERO },
            bias_growth: growth.min(initial),
            rest_variance: measured(T::of(params.rest_bias_deviation)),
            motion_variance,
            vertical_variance: motion_variance / T::of(params.vertical_forgetting_factor).max(T::of(1e-10)),
        }
    }

    /// Recomputes them if they are not for this sample time.
    #[inline]
    pub(super) fn follow(&mut self, params: &VqfParams, dt_s: T) {
        if (dt_s - self.dt_s).abs() > T::of(TOLERANCE) * self.dt_s {
            *self = Self::new(params, dt_s);
        }
    }
}

/// Coefficients for every sample of the magnetometer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FieldCoefficients<T> {
    dt_s: T,
    pub(super) field: Coefficients<T>,
    pub(super) heading_gain: T,
    pub(super) reference_gain: T,
}

impl<T: Real> FieldCoefficients<T> {
    pub(super) fn new(params: &VqfParams, dt_s: T) -> Self {
        Self {
            dt_s,
            field: Coefficients::new(T::of(params.field_time_constant), dt_s),
            heading_gain: gain(dt_s, T::of(params.heading_time_constant)),
            reference_gain: gain(dt_s, T::of(params.reference_time_constant)),
        }
    }

    /// Recomputes them if they are not for this sample time.
    #[inline]
    pub(super) fn follow(&mut self, params: &VqfParams, dt_s: T) {
        if (dt_s - self.dt_s).abs() > T::of(TOLERANCE) * self.dt_s {
            *self = Self::new(params, dt_s);
        }
    }
}
