//! Random keyframes in two forms: as the smoother holds them, and in one dense system of normal equations.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use proptest::prelude::*;

use super::super::link::{Information, Link};
use crate::navigation::eskf::tests::rows;
use crate::navigation::noise::Noise;

/// Normal equations of keyframes with `N` unknowns each, which come first, and of others.
pub(super) struct Dense<const N: usize> {
    pub(super) matrix: DMatrix<f64>,
    pub(super) vector: DVector<f64>,
}

pub(super) fn random<const R: usize, const C: usize>(noise: &mut Noise) -> SMatrix<f64, R, C> {
    SMatrix::from_fn(|_, _| noise.next())
}

impl<const N: usize> Dense<N> {
    pub(super) fn new(size: usize) -> Self {
        Self { matrix: DMatrix::zeros(size, size), vector: DVector::zeros(size) }
    }

    /// Adds rows on the unknowns from `at` on, with the inverse of the covariance of their noise.
    pub(super) fn observe(
        &mut self,
        at: usize,
        rows: &DMatrix<f64>,
        inverse: &DMatrix<f64>,
        residual: &DVector<f64>,
    ) {
        let (weighted, columns) = (rows.transpose() * inverse, rows.ncols());
        let mut view = self.matrix.view_mut((at, at), (columns, columns));
        view += &weighted * rows;
        let mut view = self.vector.rows_mut(at, columns);
        view += &weighted * residual;
    }

    /// Draws information of any rank on keyframe `k` alone, and adds it. The first keyframe is known.
    pub(super) fn own(&mut self, noise: &mut Noise, k: usize) -> Information<N> {
        let root = random::<N, N>(noise);
        let of_rank = SMatrix::<f64, N, N>::from_fn(|i, j| if k == 0 || i < k % 3 { root[(i, j)] } else { 0.0 });
        let known = of_rank.transpose() * of_rank + SMatrix::identity() * if k == 0 { 0.5 } else { 0.0 };
        let vector = known * random::<N, 1>(noise);
        let mut view = self.matrix.view_mut((k * N, k * N), (N, N));
        view += known;
        let mut view = self.vector.rows_mut(k * N, N);
        view += vector;
        Information { matrix: rows(&known), vector: vector.into() }
    }

    /// Draws the link of keyframe `k` to the previous one, and adds it: `δ_before - G δ = g + ν`. `stiffness` scales the noise.
    pub(super) fn link(&mut self, noise: &mut Noise, k: usize, stiffness: f64) -> Link<N> {
        let back = random::<N, N>(noise) * 0.3 + SMatrix::identity();
        let offset: SVector<f64, N> = random(noise);
        let root = random::<N, N>(noise);
        let covariance = (root * root.transpose() + SMatrix::identity() * 0.1) * stiffness;
        self.pair(k, &SMatrix::identity(), &-back, &covariance, &offset);
        Link {
            back: rows(&back),
            offset: offset.into(),
            noise: rows(&covariance),
            information: Information::none(),
        }
    }

    /// Adds rows on keyframe `k` and the previous one.
    pub(super) fn pair<const D: usize>(
        &mut self,
        k: usize,
        previous: &SMatrix<f64, D, N>,
        at: &SMatrix<f64, D, N>,
        covariance: &SMatrix<f64, D, D>,
        residual: &SVector<f64, D>,
    ) {
        let mut both = DMatrix::zeros(D, 2 * N);
        both.view_mut((0, 0), (D, N)).copy_from(previous);
        both.view_mut((0, N), (D, N)).copy_from(at);
        let inverse = covariance.try_inverse().unwrap();
        let inverse = DMatrix::from_column_slice(D, D, inverse.as_slice());
        self.observe((k - 1) * N, &both, &inverse, &DVector::from_column_slice(residual.as_slice()));
    }
}

/// Checks numbers that may be apart by this part of the largest.
pub(super) fn agrees(
    numbers: impl Iterator<Item = (f64, f64)>,
    within: f64,
    what: &str,
) -> Result<(), TestCaseError> {
    let pairs: Vec<_> = numbers.collect();
    let scale = pairs.iter().map(|(_, batch)| batch.abs()).fold(0.0, f64::max);
    for (here, batch) in pairs {
        prop_assert!((here - batch).abs() <= within * scale, "{what}: {here}, not {batch} (of {scale})");
    }
    Ok(())
}

/// Checks the mean and covariance of one keyframe, whose unknowns begin at `at`.
pub(super) fn agrees_at<const N: usize>(
    (mean, known): (&[f64; N], &[[f64; N]; N]),
    (solution, covariance): (&DVector<f64>, &DMatrix<f64>),
    at: usize,
    within: f64,
) -> Result<(), TestCaseError> {
    agrees((0..N).map(|i| (mean[i], solution[at + i])), within, "mean")?;
    let entries = (0..N * N).map(|e| (e / N, e % N));
    agrees(entries.map(|(i, j)| (known[i][j], covariance[(at + i, at + j)])), within, "covariance")
}
