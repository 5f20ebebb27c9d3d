//! The error of an estimate.

use super::data::Truth;
use bb_core::nalgebra::{DMatrix, DVector, Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_estimators::attitude::OrientationError;

/// An estimate in the world of the truth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) position: Vector3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) world_from_body: UnitQuaternion<f64>,
    /// Position error, then rotation error, both in the world.
    pub(crate) covariance: Matrix6<f64>,
}

/// The error of an estimate, and its reported covariance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    /// Error of the position, in the world, m.
    pub(crate) position: Vector3<f64>,
    /// Rotation vector in the world, rad; `None` if the truth has no orientation.
    pub(crate) rotation: Option<Vector3<f64>>,
    /// Errors of heading and tilt, rad; with the rotation.
    pub(crate) angles: Option<(f64, f64)>,
    pub(crate) covariance: Matrix6<f64>,
}

impl Errors {
    /// Returns the errors of an estimate. Without a true orientation, the true position is that of the antenna, a point of the body.
    pub(crate) fn between(truth: &Truth, antenna: &Vector3<f64>, estimate: &Known) -> Self {
        let Known { position, world_from_body, covariance, .. } = estimate;
        if let Some(orientation) = truth.world_from_body {
            let rotation = (orientation * world_from_body.inverse()).scaled_axis();
            let angles = OrientationError::between(world_from_body, &orientation);
            return Self {
                position: truth.position - position,
                rotation: Some(rotation),
                angles: angles.map(|angles| (angles.heading, angles.inclination)),
                covariance: *covariance,
            };
        }
        let arm = world_from_body * antenna;
        let mut jacobian = Matrix6::identity();
        // The derivative of θ × arm.
        let turned: Matrix3<f64> = -arm.cross_matrix();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&turned);
        let covariance = jacobian * covariance * jacobian.transpose();
        Self { position: truth.position - position - arm, rotation: None, angles: None, covariance }
    }

    /// The square of some of the errors, numbered as in the covariance, normalised by it; `None` if that is not positive
    /// definite, or an error is unknown.
    pub(crate) fn normalised(&self, of: &[usize]) -> Option<f64> {
        let component = |i: usize| if i < 3 { Some(self.position[i]) } else { Some(self.rotation?[i - 3]) };
        let errors: Vec<f64> = of.iter().map(|i| component(*i)).collect::<Option<_>>()?;
        let errors = DVector::from_vec(errors);
        let covariance = DMatrix::from_fn(of.len(), of.len(), |i, j| self.covariance[(of[i], of[j])]);
        let solved = covariance.cholesky()?.solve(&errors);
        Some(errors.dot(&solved)).filter(|square| square.is_finite())
    }
}
