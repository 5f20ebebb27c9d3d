//! Factors of outside providers as plain data, which can be sent, recorded and replayed.

use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};

use super::input::{blocks, check_covariance, check_position, check_rotation, check_vector};
use crate::navigation::factor::{Factor, Rows};
use crate::navigation::geodesy::Geodetic;
use crate::navigation::math::rotation_vector;
use crate::navigation::numbers::{LONGEST_WAY, MOST_GIVEN_VARIANCE};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, POSITION, ROTATION, States};

/// A factor of an outside provider on the pose of the body, at one time or at two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenFactor {
    /// Time of the pose, of two the later, ns. It becomes a keyframe.
    pub time_ns: i64,
    /// Number of the provider, if there are several.
    pub provider: u32,
    /// Form of the factor, with its numbers.
    pub form: FactorForm,
}

/// Form of a [`GivenFactor`].
#[expect(clippy::large_enum_variant, reason = "factors are passed on one by one")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FactorForm {
    /// Rows on the pose.
    Linear(LinearFactor),
    /// The pose relative to that of an earlier keyframe.
    Relative(RelativeFactor),
}

/// Up to six rows on the pose, linearised by the provider: `residual = jacobian · error + noise`, where the error is what has to be added
/// to the pose of the linearisation to get the true one: the position, m, then the rotation vector, rad, both in the tangent frame there.
/// Points of an image that were matched with a map give such rows, or the distance to a beacon gives one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearFactor {
    /// Position of the body's origin at which it was linearised.
    pub position: Geodetic,
    /// Rotates body coordinates to the tangent frame at that position.
    pub world_from_body: UnitQuaternion<f64>,
    /// The derivatives of the measured values, a row each. Rows of zeros are left out.
    pub jacobian: Matrix6<f64>,
    /// The measured values minus those expected at that pose.
    pub residual: Vector6<f64>,
    /// Covariance of the measured values.
    pub covariance: Matrix6<f64>,
}

/// A relative pose in metres, whatever the scale of the camera's is, such as that of a place that was recognised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeFactor {
    /// Time of the earlier pose, ns: a keyframe of the window, which are the frames of the camera, and the times of earlier factors.
    pub from_ns: i64,
    /// Position of the body's origin at the later time, in the axes of the body at the earlier, m.
    pub translation: Vector3<f64>,
    /// Rotates body coordinates at the later time to those at the earlier.
    pub from_to: UnitQuaternion<f64>,
    /// Covariance of the translation, m², and of the rotation vector of the error, rad², both in body axes at the later time. The
    /// cross-correlation is ignored.
    pub covariance: Matrix6<f64>,
}

impl GivenFactor {
    pub(super) fn check(&self) -> Result<(), Refusal> {
        match &self.form {
            FactorForm::Linear(linear) => linear.check(),
            FactorForm::Relative(relative) => {
                if self.time_ns <= relative.from_ns {
                    let previous_ns = relative.from_ns;
                    return Err(Refusal::TimeNotIncreasing { previous_ns, time_ns: self.time_ns });
                }
                check_vector(&relative.translation, LONGEST_WAY)?;
                check_rotation(&relative.from_to)?;
                blocks(&relative.covariance).iter().try_for_each(check_covariance)
            }
        }
    }
}

impl LinearFactor {
    fn check(&self) -> Result<(), Refusal> {
        check_position(&self.position)?;
        check_rotation(&self.world_from_body)?;
        let numbers = self.jacobian.iter().chain(&self.residual).chain(&self.covariance);
        if !numbers.clone().all(|x| x.is_finite()) {
            return Err(Refusal::NonFinite);
        }
        if !numbers.clone().all(|x| x.abs() <= MOST_GIVEN_VARIANCE) {
            return Err(Refusal::OutOfRange);
        }
        if self.jacobian.iter().all(|x| *x == 0.0) {
            return Err(Refusal::NotObservable);
        }
        self.whitened().map(drop)
    }

    /// The Jacobian and the residual, divided by the noise.
    fn whitened(&self) -> Result<(Matrix6<f64>, Vector6<f64>), Refusal> {
        let (mut residual, mut covariance) = (self.residual, self.covariance);
        let empty = |i: usize| self.jacobian.row(i).iter().all(|x| *x == 0.0);
        for i in (0..6).filter(|i| empty(*i)) {
            residual[i] = 0.0;
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
            covariance[(i, i)] = 1.0;
        }
        let root = covariance.cholesky().ok_or(Refusal::Noise)?.l();
        let (rows, residual) =
            (root.solve_lower_triangular(&self.jacobian), root.solve_lower_triangular(&residual));
        rows.zip(residual).ok_or(Refusal::Noise)
    }

    /// The rows in a world, given its coordinates of the position and the rotation from the tangent frame there to it.
    pub(super) fn in_world(&self, position: Vector3<f64>, turn: &UnitQuaternion<f64>) -> Result<PoseRows, Refusal> {
        let (rows, residual) = self.whitened()?;
        let matrix = turn.to_rotation_matrix().into_inner();
        let mut to_local = Matrix6::zeros();
        [0, 3]
            .iter()
            .for_each(|first| to_local.fixed_view_mut::<3, 3>(*first, *first).copy_from(&matrix.transpose()));
        Ok(PoseRows { position, world_from_body: turn * self.world_from_body, jacobian: rows * to_local, residual })
    }
}

/// A [`LinearFactor`] in the world of the engine, with unit noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PoseRows {
    position: Vector3<f64>,
    world_from_body: UnitQuaternion<f64>,
    jacobian: Matrix6<f64>,
    residual: Vector6<f64>,
}

impl<S: States, const N: usize> Factor<S, N> for PoseRows {
    fn linearise(&self, _: Option<&Estimate<N>>, at: &Estimate<N>, rows: &mut Rows<N>) -> Result<(), Refusal> {
        let mut moved = Vector6::zeros();
        moved.fixed_rows_mut::<3>(0).copy_from(&(at.position - self.position));
        let turned = rotation_vector(&(at.world_from_body * self.world_from_body.inverse()));
        moved.fixed_rows_mut::<3>(3).copy_from(&turned);
        let residual = self.residual - self.jacobian * moved;
        let mut jacobian = [[0.0; N]; 6];
        for (i, row) in jacobian.iter_mut().enumerate() {
            for j in 0..3 {
                row[POSITION + j] = self.jacobian[(i, j)];
                row[ROTATION + j] = self.jacobian[(i, 3 + j)];
            }
        }
        rows.set(residual.into(), None, &jacobian, &Matrix6::identity())?;
        rows.leave_out_empty();
        Ok(())
    }
}
