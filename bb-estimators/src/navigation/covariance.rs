//! The error covariance: exactly symmetric, and kept positive definite.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

mod dense;
mod innovation;

use nalgebra::{Matrix2, Matrix3, SMatrix};

pub(in crate::navigation) use self::dense::Dense;
use self::dense::is_regular;
pub(in crate::navigation) use self::innovation::{Innovation, Room};
use super::layout::Layout;
use super::refusal::Refusal;

/// Number of updates between two checks by a Cholesky decomposition.
const CHECK_EVERY: u32 = 1024;

/// Covariance of `N` errors, in the squares of their units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct Covariance<const N: usize> {
    matrix: SMatrix<f64, N, N>,
    updates: u32,
    repairs: u64,
}

impl<const N: usize> Covariance<N> {
    pub(in crate::navigation) fn new() -> Self {
        Self { matrix: SMatrix::identity(), updates: 0, repairs: 0 }
    }

    pub(in crate::navigation) fn matrix(&self) -> &SMatrix<f64, N, N> {
        &self.matrix
    }

    /// Returns the number of times that a check failed and variances were raised.
    pub(in crate::navigation) fn repairs(&self) -> u64 {
        self.repairs
    }

    /// The rows of the matrix, which are also its columns.
    #[inline]
    pub(in crate::navigation) fn rows_mut(&mut self) -> &mut [[f64; N]; N] {
        &mut self.matrix.data.0
    }

    #[inline]
    fn rows(&self) -> &[[f64; N]; N] {
        &self.matrix.data.0
    }

    /// Resets a state and its correlations.
    pub(in crate::navigation) fn forget(&mut self, state: usize, variance: f64) {
        let p = self.rows_mut();
        p[state] = [0.0; N];
        for row in p.iter_mut() {
            row[state] = 0.0;
        }
        p[state][state] = variance;
    }

    /// Sets the covariance of three states; they are uncorrelated with all others.
    pub(in crate::navigation) fn set(&mut self, first: usize, block: &Matrix3<f64>) {
        for i in 0..3 {
            self.forget(first + i, 0.0);
        }
        for i in 0..3 {
            for j in 0..3 {
                self.rows_mut()[first + i][first + j] = 0.5 * (block[(i, j)] + block[(j, i)]);
            }
        }
    }

    /// Sets the covariance of two states; they are uncorrelated with all others.
    pub(in crate::navigation) fn set_pair(&mut self, first: usize, block: &Matrix2<f64>) {
        (0..2).for_each(|i| self.forget(first + i, block[(i, i)]));
        let between = 0.5 * (block[(0, 1)] + block[(1, 0)]);
        self.rows_mut()[first][first + 1] = between;
        self.rows_mut()[first + 1][first] = between;
    }

    /// Makes `target` the same random variable as `source`, up to `variance`.
    pub(in crate::navigation) fn copy(&mut self, source: usize, target: usize, variance: f64) {
        let p = self.rows_mut();
        let mut row = p[source];
        row[target] = row[source] + variance;
        p[target] = row;
        for (i, value) in row.into_iter().enumerate() {
            p[i][target] = value;
        }
    }

    /// First-order Gauss–Markov step of one state: scales by the factor, then adds the noise.
    #[inline]
    pub(in crate::navigation) fn decay(&mut self, state: usize, factor: f64, variance: f64) {
        let p = self.rows_mut();
        for j in 0..N {
            p[state][j] *= factor;
        }
        for row in p.iter_mut() {
            row[state] *= factor;
        }
        // Both passes scaled the diagonal.
        p[state][state] += variance;
    }

    /// Clamps variances to bounds that amount to unknown, so that no number overflows.
    #[inline]
    pub(in crate::navigation) fn bound(&mut self, layout: &Layout<N>) {
        if self.is_lost(layout) {
            self.dense().shrink(&layout.largest);
        }
    }

    #[inline]
    fn is_lost(&self, layout: &Layout<N>) -> bool {
        (0..N).any(|i| self.matrix[(i, i)] > layout.lost[i])
    }

    /// Adds to a variance.
    pub(in crate::navigation) fn inflate(&mut self, state: usize, variance: f64) {
        self.rows_mut()[state][state] += variance;
    }

    /// Multiplies the matrix.
    pub(in crate::navigation) fn multiply(&mut self, factor: f64) {
        self.matrix *= factor;
    }

    /// Adds a block between three states and three others or the same; its transpose is added too.
    pub(in crate::navigation) fn add(&mut self, row: usize, column: usize, block: &Matrix3<f64>) {
        let p = self.rows_mut();
        for i in 0..3 {
            for j in 0..3 {
                if row == column {
                    p[row + i][column + j] += 0.5 * (block[(i, j)] + block[(j, i)]);
                } else {
                    p[row + i][column + j] += block[(i, j)];
                    p[column + j][row + i] += block[(i, j)];
                }
            }
        }
    }

    /// Rotates three states by a matrix close to the identity: `P ← G P Gᵀ`.
    pub(in crate::navigation) fn transform(&mut self, first: usize, block: &Matrix3<f64>) {
        let p = self.rows_mut();
        let old = [p[first], p[first + 1], p[first + 2]];
        for i in 0..3 {
            for j in 0..N {
                p[first + i][j] = block[(i, 0)] * old[0][j] + block[(i, 1)] * old[1][j] + block[(i, 2)] * old[2][j];
            }
        }
        for row in p.iter_mut() {
            let old = [row[first], row[first + 1], row[first + 2]];
            for i in 0..3 {
                row[first + i] = block[(i, 0)] * old[0] + block[(i, 1)] * old[1] + block[(i, 2)] * old[2];
            }
        }
        // The two summation orders round differently.
        for i in 0..3 {
            for j in 0..N {
                p[j][first + i] = p[first + i][j];
            }
        }
    }

    /// Adds a multiple of another state to a state: `x_i ← x_i + f x_j`.
    #[inline]
    pub(in crate::navigation) fn shear(&mut self, i: usize, factor: f64, j: usize) {
        let p = self.rows_mut();
        let (own, other) = (p[i], p[j]);
        p[i] = core::array::from_fn(|k| own[k] + factor * other[k]);
        for k in 0..N {
            p[k][i] = p[i][k];
        }
        p[i][i] = own[i] + factor * (2.0 * other[i] + factor * other[j]);
    }

    /// Transforms three states, and adds others to them: `x ← G x + D y`.
    pub(in crate::navigation) fn transform_with(
        &mut self,
        first: usize,
        own: &Matrix3<f64>,
        other: usize,
        by_other: &Matrix3<f64>,
    ) {
        let p = self.rows_mut();
        let (x, y) = ([p[first], p[first + 1], p[first + 2]], [p[other], p[other + 1], p[other + 2]]);
        for i in 0..3 {
            for j in 0..N {
                let own = own[(i, 0)] * x[0][j] + own[(i, 1)] * x[1][j] + own[(i, 2)] * x[2][j];
                let more = by_other[(i, 0)] * y[0][j] + by_other[(i, 1)] * y[1][j] + by_other[(i, 2)] * y[2][j];
                p[first + i][j] = own + more;
            }
        }
        // The columns of the other rows are the new rows; those of the new rows are transformed once more.
        for j in (0..N).filter(|j| !(first..first + 3).contains(j)) {
            for i in 0..3 {
                p[j][first + i] = p[first + i][j];
            }
        }
        for i in 0..3 {
            let row = p[first + i];
            for k in 0..3 {
                let own = own[(k, 0)] * row[first] + own[(k, 1)] * row[first + 1] + own[(k, 2)] * row[first + 2];
                let more = by_other[(k, 0)] * row[other]
                    + by_other[(k, 1)] * row[other + 1]
                    + by_other[(k, 2)] * row[other + 2];
                p[first + i][first + k] = own + more;
            }
        }
        for i in 0..3 {
            for k in 0..i {
                p[first + i][first + k] = p[first + k][first + i];
            }
        }
    }

    /// The innovation of a measurement whose noise is multiplied.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`] or [`Refusal::Noise`].
    #[inline]
    pub(in crate::navigation) fn innovation<'a, const D: usize>(
        &self,
        room: &'a mut Room<D, N>,
        noise_factor: f64,
    ) -> Result<Innovation<'a>, Refusal> {
        room.innovation(self.rows(), noise_factor)
    }

    /// `P ← P - Wᵀ W`: the update in the order of the decomposition, one scalar at a time.
    #[inline]
    pub(in crate::navigation) fn update(&mut self, innovation: &Innovation<'_>) {
        subtract(self.rows_mut(), innovation.gain());
        self.updates += 1;
        if innovation.is_risky() || (0..N).any(|i| self.matrix[(i, i)] <= 0.0) {
            self.updates = CHECK_EVERY;
        }
    }

    /// Checks the matrix if a check is due, once the update is complete.
    #[inline]
    pub(in crate::navigation) fn settle(&mut self, layout: &Layout<N>) {
        if self.updates >= CHECK_EVERY || self.is_lost(layout) {
            self.enforce();
        }
    }

    /// Returns whether a Cholesky decomposition exists.
    pub(in crate::navigation) fn is_positive_definite(&self) -> bool {
        is_regular(N, self.rows().as_flattened(), 0.0)
    }

    /// Raises variances until the matrix is positive definite.
    #[cold]
    pub(in crate::navigation) fn enforce(&mut self) {
        self.dense().enforce();
    }

    /// Covariance for operations that are rare.
    pub(in crate::navigation) fn dense(&mut self) -> Dense<'_> {
        let Self { matrix, updates, repairs } = self;
        Dense { n: N, p: matrix.data.0.as_flattened_mut(), updates, repairs }
    }
}

/// `P - Wᵀ W`. Arguments of their own tell the compiler that they do not overlap.
#[inline]
fn subtract<const N: usize>(p: &mut [[f64; N]; N], gain: &[[f64; N]]) {
    if let [gain] = gain {
        p.iter_mut().zip(gain).for_each(|(row, factor)| subtract_row(row, *factor, gain));
        return;
    }
    for (i, row) in p.iter_mut().enumerate() {
        // In registers until all are subtracted.
        let mut rest = *row;
        gain.iter().for_each(|gain| subtract_row(&mut rest, gain[i], gain));
        *row = rest;
    }
}

/// Both halves of the matrix use the same product, so they round alike.
#[inline]
fn subtract_row<const N: usize>(row: &mut [f64; N], factor: f64, gain: &[f64; N]) {
    row.iter_mut().zip(gain).for_each(|(x, other)| *x -= factor * other);
}
