//! Detection of rest: section 3.5 of the paper.

use nalgebra::Vector3;

use super::VqfParams;
use super::coefficients::InertialCoefficients;
use super::low_pass::LowPass;
use crate::attitude::Real;

/// Detects rest by the deviation of gyroscope and accelerometer from their low-passed values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rest<T> {
    rates: LowPass<T, 3>,
    forces: LowPass<T, 3>,
    /// Low-passed angular velocity, rad/s.
    pub(super) rate: Vector3<T>,
    still_s: T,
    detected: bool,
}

impl<T: Real> Rest<T> {
    pub(super) fn new() -> Self {
        Self {
            rates: LowPass::new(),
            forces: LowPass::new(),
            rate: Vector3::zeros(),
            still_s: T::ZERO,
            detected: false,
        }
    }

    pub(super) fn is_detected(&self) -> bool {
        self.detected
    }

    /// Initialises the means with a sample.
    pub(super) fn average_first(
        &mut self,
        coefficients: &InertialCoefficients<T>,
        rate: &Vector3<T>,
        force: &Vector3<T>,
    ) {
        self.rate = self.rates.filter(&(*rate).into(), T::ZERO, &coefficients.rest).into();
        self.forces.filter(&(*force).into(), T::ZERO, &coefficients.rest);
    }

    /// Adds an angular velocity, rad/s; ends rest if it differs too much or is too large for a bias.
    #[inline]
    pub(super) fn add_rate(
        &mut self,
        params: &VqfParams,
        dt_s: T,
        coefficients: &InertialCoefficients<T>,
        rate: &Vector3<T>,
    ) {
        self.rate = self.rates.filter(&(*rate).into(), dt_s, &coefficients.rest).into();
        let deviation = (rate - self.rate).norm_squared();
        if deviation >= T::of(params.rest_angular_velocity * params.rest_angular_velocity)
            || self.rate.norm_squared() > T::of(params.largest_bias * params.largest_bias)
        {
            self.end();
        }
    }

    /// Adds a specific force, m/s²; ends rest if it differs too much, otherwise the sensor may be at rest.
    #[inline]
    pub(super) fn add_force(
        &mut self,
        params: &VqfParams,
        dt_s: T,
        coefficients: &InertialCoefficients<T>,
        force: &Vector3<T>,
    ) {
        let mean: Vector3<T> = self.forces.filter(&(*force).into(), dt_s, &coefficients.rest).into();
        if (force - mean).norm_squared() >= T::of(params.rest_specific_force * params.rest_specific_force) {
            self.end();
            return;
        }
        self.still_s += dt_s;
        self.detected |= self.still_s >= T::of(params.rest_time);
    }

    fn end(&mut self) {
        self.still_s = T::ZERO;
        self.detected = false;
    }
}
