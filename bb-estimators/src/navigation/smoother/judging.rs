//! The gate of landmarks: compares an observation with the estimated position of its landmark.
//!
//! An error that all keyframes share also moves the landmark, except for the part held by its prior, and so does not count. The
//! gate uses the error of the motion between this keyframe, with error x, and the one that saw the landmark last. The links between
//! them give the earlier keyframe the error `x_a = T x + n`. If both moved as one rigid body, it would be `R x`. The difference,
//! `(T - R) x + n`, is the error of the motion.

use alloc::vec;
use alloc::vec::Vec;

use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};

use super::coupling::{POSE, place};
use super::keyframe::Window;
use super::landmark::{Landmark, Sight};
use super::matrix::Square;
use crate::navigation::fused::Judged;
use crate::navigation::math::ln;

/// The covariances for gating the observations at one keyframe, as they were before the first.
#[derive(Clone, Debug)]
pub(super) struct Judging<const N: usize> {
    /// The keyframe; `None` if the window has changed since.
    keyframe: Option<(u64, usize)>,
    covariance: SMatrix<f64, N, N>,
    /// The covariances of the motions between that keyframe and each of the window, computed on demand.
    motions: Vec<Option<SMatrix<f64, POSE, POSE>>>,
}

impl<const N: usize> Judging<N> {
    pub(super) fn new(slots: usize) -> Self {
        Self { keyframe: None, covariance: SMatrix::zeros(), motions: vec![None; slots] }
    }

    /// Forgets the keyframe, since the window has changed.
    pub(super) fn forget(&mut self) {
        self.keyframe = None;
    }

    pub(super) fn is_of(&self, id: u64) -> bool {
        self.keyframe.is_some_and(|(known, _)| known == id)
    }

    pub(super) fn begin(&mut self, id: u64, at: usize, covariance: &Square<N>) {
        self.keyframe = Some((id, at));
        self.covariance = SMatrix::from_fn(|i, j| covariance[i][j]);
        self.motions.fill(None);
    }

    /// Compares an observation with a landmark whose nearest other observation is that of the keyframe `nearest`. Returns
    /// `None` if a number is not finite.
    pub(super) fn judge<F>(
        &mut self,
        landmark: &Landmark,
        sight: &Sight,
        innovation: &Vector2<f64>,
        window: &Window<F, N>,
        nearest: Option<usize>,
    ) -> Option<Judged> {
        let jacobian = sight.jacobian;
        let along = |share: Matrix2x3<f64>| {
            let mut whole = SMatrix::<f64, 2, POSE>::zeros();
            whole.fixed_columns_mut::<3>(0).copy_from(&-share);
            whole.fixed_columns_mut::<3>(3).copy_from(&(share * sight.arm.cross_matrix()));
            whole
        };
        let pose = SMatrix::<f64, POSE, POSE>::from_fn(|i, j| self.covariance[(place(i), place(j))]);
        let projected = |rows: SMatrix<f64, 2, POSE>, by: &SMatrix<f64, POSE, POSE>| rows * by * rows.transpose();
        let mut covariance = Matrix2::identity() + landmark.seen_covariance(&jacobian);
        covariance += projected(along(jacobian * landmark.held()), &pose);
        if let Some(nearest) = nearest {
            covariance += projected(along(jacobian), &self.motion(nearest, window)?);
        }
        let root = covariance.cholesky()?.l();
        let whitened = root.solve_lower_triangular(innovation)?;
        let nis = whitened.norm_squared();
        let noise = sight.seen.jacobian * sight.precision;
        let log_density = ln(noise.determinant().abs()) - ln(root[(0, 0)] * root[(1, 1)]);
        nis.is_finite().then_some(Judged { nis, log_density, whitened: whitened.x })
    }

    /// The covariance of the motion between the judged keyframe and another.
    fn motion<F>(&mut self, other: usize, window: &Window<F, N>) -> Option<SMatrix<f64, POSE, POSE>> {
        let (_, at) = self.keyframe?;
        if let Some(known) = self.motions.get(other).copied().flatten() {
            return Some(known);
        }
        if other < at {
            self.motions_back(at, other, window)
        } else {
            // A late observation: the biases and the velocity there are hardly known better.
            self.motions_back(other, at, window)
        }?;
        self.motions.get(other).copied().flatten()
    }

    /// Computes the motions between keyframe `from` and an earlier one, `to`, one of which is the judged keyframe.
    fn motions_back<F>(&mut self, from: usize, to: usize, window: &Window<F, N>) -> Option<()> {
        let (_, at) = self.keyframe?;
        let later = &window.get(from)?.point;
        let mut transition = SMatrix::<f64, N, N>::identity();
        let mut noise = SMatrix::<f64, N, N>::zeros();
        for index in (to..from).rev() {
            let link = &window.get(index + 1)?.link;
            let back = SMatrix::<f64, N, N>::from_fn(|i, j| link.back[i][j]);
            transition = back * transition;
            noise = back * noise * back.transpose() + SMatrix::<f64, N, N>::from_fn(|i, j| link.noise[i][j]);
            if from != at && index != to {
                continue;
            }
            let apart: Vector3<f64> = later.position - window.get(index)?.point.position;
            // T - R, in which the position of the earlier keyframe follows the rotation.
            let mut relative = SMatrix::<f64, POSE, N>::from_fn(|i, j| transition[(place(i), j)]);
            (0..POSE).for_each(|i| relative[(i, place(i))] -= 1.0);
            let turned = apart.cross_matrix();
            for (i, j) in (0..9).map(|entry| (entry / 3, entry % 3)) {
                relative[(i, place(3 + j))] -= turned[(i, j)];
            }
            let of_noise = SMatrix::<f64, POSE, POSE>::from_fn(|i, j| noise[(place(i), place(j))]);
            let motion = relative * self.covariance * relative.transpose() + of_noise;
            // An error of the rotation at the earlier keyframe, as one of the position at the later.
            let mut moved = SMatrix::<f64, POSE, POSE>::identity();
            let by_rotation: Matrix3<f64> = -turned;
            if from == at {
                moved.fixed_view_mut::<3, 3>(0, 3).copy_from(&by_rotation);
            }
            let target = if from == at { index } else { from };
            *self.motions.get_mut(target)? = Some(moved * motion * moved.transpose());
        }
        Some(())
    }
}

impl Landmark {
    /// The nearest keyframe that saw the landmark; the earlier one of two equally near.
    pub(super) fn nearest(&self, serial: u64) -> Option<u64> {
        self.sights.iter().map(|sight| sight.serial).min_by_key(|other| other.abs_diff(serial))
    }
}
