//! Relative poses between two keyframes, from visual or lidar odometry.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::rows::Rows;
use crate::navigation::math::{rotation_vector, skew};
use crate::navigation::measurement::RelativePose;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, Optional, POSITION, ROTATION, States, offset};

/// Compares with the poses of both keyframes: `R_k t - (1 + s) (p - p_k)` and `log(R_k Q Rᵀ)`, in the world's axes.
///
/// As in [`Link::of_motion`](super::link::Link::of_motion), the derivative of the translation with respect to rotation
/// is taken from the estimates, and that of the logarithm is the identity. Rotating the whole world therefore changes
/// nothing. The gradient of the cost is still exact where the noise is isotropic, since the neglected part is normal to
/// the residual.
pub(super) fn compare<S: States, const N: usize>(
    measured: &RelativePose,
    previous: &Estimate<N>,
    at: &Estimate<N>,
    rows: &mut Rows<N>,
) -> Result<(), Refusal> {
    let scale = 1.0 + at.scalar::<S>(Optional::RelativeScale);
    let way = at.position - previous.position;
    let expected = previous.world_from_body * measured.translation;
    let turned = previous.world_from_body * measured.keyframe_from_body * at.world_from_body.inverse();
    let turn = rotation_vector(&turned);

    let mut residual = [0.0; 6];
    let translation = expected - way * scale;
    for i in 0..3 {
        residual[i] = translation[i];
        residual[3 + i] = turn[i];
    }
    let mut of_previous = [[0.0; N]; 6];
    let mut of_this = [[0.0; N]; 6];
    set(&mut of_this, 0, POSITION, &Matrix3::from_diagonal_element(scale));
    set(&mut of_previous, 0, POSITION, &Matrix3::from_diagonal_element(-scale));
    set(&mut of_previous, 0, ROTATION, &(skew(&way) * scale));
    if let Some(index) = offset::<S>(Optional::RelativeScale) {
        set_column(&mut of_this, index, &way);
    }
    set(&mut of_this, 3, ROTATION, &Matrix3::identity());
    set(&mut of_previous, 3, ROTATION, &-Matrix3::identity());

    let to_world = at.rotation();
    let mut noise = SMatrix::<f64, 6, 6>::zeros();
    let mut set_noise = |first: usize, covariance: &Matrix3<f64>| {
        let block = to_world * covariance * to_world.transpose();
        noise.fixed_view_mut::<3, 3>(first, first).copy_from(&block);
    };
    set_noise(0, &measured.translation_covariance);
    set_noise(3, &measured.rotation_covariance);
    rows.set(residual, Some(&of_previous), &of_this, &noise)
}

fn set<const N: usize>(rows: &mut [[f64; N]; 6], row: usize, column: usize, block: &Matrix3<f64>) {
    for i in 0..3 {
        for j in 0..3 {
            rows[row + i][column + j] = block[(i, j)];
        }
    }
}

fn set_column<const N: usize>(rows: &mut [[f64; N]; 6], column: usize, values: &Vector3<f64>) {
    for i in 0..3 {
        rows[i][column] = values[i];
    }
}
