//! The pose in the world, from a map, a satellite image or a tracking system.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{Linearised, Measurement, isotropic};
use crate::navigation::math::rotation_vector;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, POSITION, ROTATION, States};

/// Position and orientation of the body in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AbsolutePose {
    /// Position of the body's origin in the world, m.
    pub position: Vector3<f64>,
    /// Rotates body coordinates to world coordinates.
    pub world_from_body: UnitQuaternion<f64>,
    /// Covariance of the position, in the world, m².
    pub position_covariance: Matrix3<f64>,
    /// Covariance of the rotation vector of the error, in the world, rad².
    pub rotation_covariance: Matrix3<f64>,
}

impl AbsolutePose {
    /// A pose with isotropic noise: standard deviations in m and rad.
    pub fn new(position: (Vector3<f64>, f64), world_from_body: (UnitQuaternion<f64>, f64)) -> Self {
        Self {
            position: position.0,
            world_from_body: world_from_body.0,
            position_covariance: isotropic(position.1),
            rotation_covariance: isotropic(world_from_body.1),
        }
    }
}

impl Measurement<6> for AbsolutePose {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<6, N>,
    ) -> Result<(), Refusal> {
        model.set_residual(0, &(self.position - at.position));
        model.set_noise(0, &self.position_covariance);
        model.set_block(0, POSITION, &Matrix3::identity());
        model.set_residual(3, &rotation_vector(&(self.world_from_body * at.world_from_body.inverse())));
        model.set_noise(3, &self.rotation_covariance);
        model.set_block(3, ROTATION, &Matrix3::identity());
        Ok(())
    }
}
