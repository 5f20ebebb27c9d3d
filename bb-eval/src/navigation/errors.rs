//! The error of an estimate.

use super::data::Truth;
use super::step::Known;
use bb_core::nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use bb_estimators::navigation::nees;

/// The error of an estimate, and its reported covariance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    /// In the world, m.
    pub(crate) position: Vector3<f64>,
    /// Rotation vector in the world, rad; `None` if the truth has no orientation.
    pub(crate) rotation: Option<Vector3<f64>>,
    pub(crate) covariance: Matrix6<f64>,
}

impl Errors {
    /// Without a true orientation, the true position is that of the antenna, a point of the body.
    pub(crate) fn between(truth: &Truth, antenna: &Vector3<f64>, estimate: &Known) -> Self {
        let Known { position, world_from_body, covariance, .. } = estimate;
        if let Some(orientation) = truth.world_from_body {
            let rotation = (orientation * world_from_body.inverse()).scaled_axis();
            return Self { position: truth.position - position, rotation: Some(rotation), covariance: *covariance };
        }
        let arm = world_from_body * antenna;
        let mut jacobian = Matrix6::identity();
        // Of θ × arm.
        let turned: Matrix3<f64> = -arm.cross_matrix();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&turned);
        let covariance = jacobian * covariance * jacobian.transpose();
        Self { position: truth.position - position - arm, rotation: None, covariance }
    }

    /// Normalised estimation error squared; `None` if the covariance is not positive definite.
    pub(crate) fn nees(&self) -> Option<f64> {
        match &self.rotation {
            Some(rotation) => {
                let error = Vector6::from_fn(|i, _| if i < 3 { self.position[i] } else { rotation[i - 3] });
                nees(&error, &self.covariance)
            }
            None => nees(&self.position, &self.covariance.fixed_view::<3, 3>(0, 0).into_owned()),
        }
    }
}
