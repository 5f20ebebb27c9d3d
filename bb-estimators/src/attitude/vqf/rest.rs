//! Whether the sensor lies still: section 3.5 of the paper.

use nalgebra::Vector3;

use super::VqfParams;
use super::coefficients::InertialCoefficients;
use super::low_pass::LowPass;

/// Recognises rest by how far gyroscope and accelerometer are from their low-passed values.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rest {
    rates: LowPass<3>,
    forces: LowPass<3>,
    /// Low-passed angular velocity, rad/s.
    pub(super) rate: Vector3<f64>,
    still_s: f64,
    detected: bool,
}

impl Rest {
    pub(super) fn new() -> Self {
        Self {
            rates: LowPass::new(),
            forces: LowPass::new(),
            rate: Vector3::zeros(),
            still_s: 0.0,
            detected: false,
        }
    }

    pub(super) fn is_detected(&self) -> bool {
        self.detected
    }

    /// Lets the means begin with a sample.
    pub(super) fn average_first(
        &mut self,
        coefficients: &InertialCoefficients,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
    ) {
        self.rate = self.rates.filter(&(*rate).into(), 0.0, &coefficients.rest).into();
        self.forces.filter(&(*force).into(), 0.0, &coefficients.rest);
    }

    /// Takes an angular velocity, rad/s, and ends rest if it differs too much or is too large for a bias.
    #[inline]
    pub(super) fn add_rate(
        &mut self,
        params: &VqfParams,
        dt_s: f64,
        coefficients: &InertialCoefficients,
        rate: &Vector3<f64>,
    ) {
        self.rate = self.rates.filter(&(*rate).into(), dt_s, &coefficients.rest).into();
        let deviation = (rate - self.rate).norm_squared();
        if deviation >= params.rest_angular_velocity * params.rest_angular_velocity
            || self.rate.norm_squared() > params.largest_bias * params.largest_bias
        {
            self.end();
        }
    }

    /// Takes a specific force, m/s², and ends rest if it differs too much; else the sensor may lie still.
    #[inline]
    pub(super) fn add_force(
        &mut self,
        params: &VqfParams,
        dt_s: f64,
        coefficients: &InertialCoefficients,
        force: &Vector3<f64>,
    ) {
        let mean: Vector3<f64> = self.forces.filter(&(*force).into(), dt_s, &coefficients.rest).into();
        if (force - mean).norm_squared() >= params.rest_specific_force * params.rest_specific_force {
            self.end();
            return;
        }
        self.still_s += dt_s;
        self.detected |= self.still_s >= params.rest_time;
    }

    fn end(&mut self) {
        self.still_s = 0.0;
        self.detected = false;
    }
}
