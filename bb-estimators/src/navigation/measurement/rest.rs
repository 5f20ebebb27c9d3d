//! Measurements of a body at rest.

use nalgebra::Matrix3;

use super::{Linearised, Measurement, isotropic};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, GYROSCOPE_BIAS, States, VELOCITY};

/// The velocity is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZeroVelocity {
    /// Standard deviation of a component, m/s.
    pub deviation: f64,
}

/// The angular velocity is zero: the gyroscope's last sample is its bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZeroRotation {
    /// Standard deviation of a component, the gyroscope's noise in one sample included, rad/s.
    pub deviation: f64,
}

impl Measurement<3> for ZeroVelocity {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<3, N>,
    ) -> Result<(), Refusal> {
        model.set_residual(0, &-at.velocity);
        model.set_noise(0, &isotropic(self.deviation));
        model.set_block(0, VELOCITY, &Matrix3::identity());
        Ok(())
    }
}

impl Measurement<3> for ZeroRotation {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<3, N>,
    ) -> Result<(), Refusal> {
        model.set_residual(0, &at.angular_velocity);
        model.set_noise(0, &isotropic(self.deviation));
        model.set_block(0, GYROSCOPE_BIAS, &Matrix3::identity());
        Ok(())
    }
}
