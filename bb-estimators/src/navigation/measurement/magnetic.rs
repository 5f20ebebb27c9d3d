//! The magnetic field: the full vector, or only its heading.

use nalgebra::Vector3;

use super::gnss::heading_of;
use super::{Linearised, Measurement, isotropic};
use crate::navigation::math::{skew, wrapped};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, Optional, ROTATION, States, offset};

/// The magnetic field, if it is known in the world: `Rᵀ m + h`, with the hard iron h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticField {
    /// Measured field, body axes, T.
    pub field: Vector3<f64>,
    /// Known field in the world, T.
    pub reference: Vector3<f64>,
    /// Standard deviation of a component, T.
    pub deviation: f64,
}

/// The heading of the magnetic field, which by itself carries no information about tilt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MagneticHeading {
    /// Measured field, body axes, T.
    pub field: Vector3<f64>,
    /// Declination: magnetic north from true north, east positive, rad.
    pub declination: f64,
    /// Standard deviation of the heading, rad.
    pub deviation: f64,
}

impl Measurement<3> for MagneticField {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<3, N>,
    ) -> Result<(), Refusal> {
        let rotation = at.rotation();
        let field = self.field - at.vector::<S>(Optional::HardIron);
        // In the world, R (m - h) rotates by θ × m, and the isotropic noise is unchanged.
        model.set_residual(0, &(rotation * field - self.reference));
        model.set_noise(0, &isotropic(self.deviation));
        model.set_block(0, ROTATION, &skew(&self.reference));
        if let Some(index) = offset::<S>(Optional::HardIron) {
            model.set_block(0, index, &rotation);
        }
        Ok(())
    }
}

impl Measurement<1> for MagneticHeading {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<1, N>,
    ) -> Result<(), Refusal> {
        let field = at.world_from_body * (self.field - at.vector::<S>(Optional::HardIron));
        let (heading, gradient) = heading_of(&field).ok_or(Refusal::NotObservable)?;
        let north = core::f64::consts::FRAC_PI_2 - self.declination;
        model.residual[0] = wrapped(north - heading);
        model.noise[(0, 0)] = self.deviation * self.deviation;
        model.set_row(0, ROTATION, &field.cross(&gradient));
        if let Some(index) = offset::<S>(Optional::HardIron) {
            model.set_row(0, index, &-(at.rotation().transpose() * gradient));
        }
        Ok(())
    }
}
