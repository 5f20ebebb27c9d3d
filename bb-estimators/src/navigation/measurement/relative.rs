//! Relative poses of visual or lidar odometry.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::{Linearised, Measurement, isotropic};
use crate::navigation::math::{rotation_vector, skew};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, Optional, POSITION, ROTATION, States, offset};

/// The pose of the body in the frame of a keyframe, which the filter holds as [`Optional::Keyframe`]:
/// `translation = (1 + s) R_kᵀ (p - p_k)`, `keyframe_from_body = R_kᵀ R`, with [`Optional::RelativeScale`] s.
///
/// Both the keyframe and the current pose are in the error vector, so their common error cancels. No information is counted
/// twice, and the uncertainty of heading and position in the world is preserved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePose {
    /// The keyframe, as passed to [`EskfFilter::set_keyframe`](crate::navigation::EskfFilter::set_keyframe).
    pub keyframe: u64,
    /// Position of the body's origin, in the keyframe's axes, m.
    pub translation: Vector3<f64>,
    /// Rotates body coordinates to keyframe coordinates.
    pub keyframe_from_body: UnitQuaternion<f64>,
    /// Covariance of the translation, current body axes, m².
    pub translation_covariance: Matrix3<f64>,
    /// Covariance of the rotation vector of the error, current body axes, rad².
    pub rotation_covariance: Matrix3<f64>,
}

impl RelativePose {
    /// A relative pose with isotropic noise: standard deviations in m and rad.
    pub fn new(
        keyframe: u64,
        translation: (Vector3<f64>, f64),
        keyframe_from_body: (UnitQuaternion<f64>, f64),
    ) -> Self {
        Self {
            keyframe,
            translation: translation.0,
            keyframe_from_body: keyframe_from_body.0,
            translation_covariance: isotropic(translation.1),
            rotation_covariance: isotropic(keyframe_from_body.1),
        }
    }
}

impl Measurement<6> for RelativePose {
    fn linearise<S: States, const N: usize>(
        &self,
        at: &Estimate<N>,
        model: &mut Linearised<6, N>,
    ) -> Result<(), Refusal> {
        let missing = Refusal::NoKeyframe { id: self.keyframe };
        let index = offset::<S>(Optional::Keyframe).ok_or(missing)?;
        let keyframe = at.keyframe.filter(|keyframe| keyframe.id == self.keyframe).ok_or(missing)?;
        let scale = 1.0 + at.scalar::<S>(Optional::RelativeScale);
        let way = at.position - keyframe.position;
        let rotation = at.rotation();
        let to_world = |covariance: &Matrix3<f64>| rotation * covariance * rotation.transpose();

        // In world axes, where the Jacobians of all rotation errors are simplest.
        model.set_residual(0, &(keyframe.world_from_body * self.translation - way * scale));
        model.set_noise(0, &to_world(&self.translation_covariance));
        model.set_block(0, POSITION, &(Matrix3::identity() * scale));
        model.set_block(0, index, &(Matrix3::identity() * -scale));
        model.set_block(0, index + 3, &(skew(&way) * scale));
        if let Some(scale) = offset::<S>(Optional::RelativeScale) {
            model.set_column(0, scale, &way);
        }

        let measured = keyframe.world_from_body * self.keyframe_from_body;
        model.set_residual(3, &rotation_vector(&(measured * at.world_from_body.inverse())));
        model.set_noise(3, &to_world(&self.rotation_covariance));
        model.set_block(3, ROTATION, &Matrix3::identity());
        model.set_block(3, index + 3, &-Matrix3::identity());
        Ok(())
    }
}
