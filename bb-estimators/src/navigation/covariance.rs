//! The covariance of the errors: symmetric to the last bit, and kept positive definite.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector};

use super::math::{ln, sqrt};

/// One update never takes more than this ratio of variance out of a direction: what rounding adds, 1e-16 of what was
/// there, stays far below what is left.
const LEAST_NOISE: f64 = 1e-10;

/// The largest variance of a position or a velocity that says anything: 10,000 km, or as much a second.
pub(in crate::navigation) const MOST_VARIANCE: f64 = 1e14;

/// The largest variance of a rotation error, rad²: a hundred turns are as good as one.
pub(in crate::navigation) const MOST_ROTATION: f64 = 4e5;

/// Updates between two checks by a Cholesky decomposition.
const CHECK_EVERY: u32 = 1024;

/// What a variance is raised by, relatively, where a check fails.
const REPAIR: f64 = 1e-9;

/// Covariance of `N` errors, in the square of their units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct Covariance<const N: usize> {
    matrix: SMatrix<f64, N, N>,
    updates: u32,
    repairs: u64,
}

/// An innovation, decomposed.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Innovation<const D: usize, const N: usize> {
    /// `L⁻¹ H P`, with `L Lᵀ = H P Hᵀ + R`.
    gain: [[f64; N]; D],
    /// `L⁻¹` times the residual: standard normal where model and measurement agree.
    pub(in crate::navigation) whitened: [f64; D],
    /// `det S` to the power of -½.
    density: f64,
}

impl<const D: usize, const N: usize> Innovation<D, N> {
    /// Normalised innovation squared.
    pub(in crate::navigation) fn nis(&self) -> f64 {
        self.whitened.iter().map(|x| x * x).sum()
    }

    /// The mean of the errors, given the residual.
    #[inline]
    pub(in crate::navigation) fn mean(&self) -> SVector<f64, N> {
        let mut mean = SVector::<f64, N>::zeros();
        for (gain, whitened) in self.gain.iter().zip(&self.whitened) {
            for i in 0..N {
                mean[i] += gain[i] * whitened;
            }
        }
        mean
    }

    /// `-½ ln det S`.
    pub(in crate::navigation) fn log_density(&self) -> f64 {
        ln(self.density)
    }
}

impl<const N: usize> Covariance<N> {
    pub(in crate::navigation) fn new() -> Self {
        Self { matrix: SMatrix::identity(), updates: 0, repairs: 0 }
    }

    pub(in crate::navigation) fn matrix(&self) -> &SMatrix<f64, N, N> {
        &self.matrix
    }

    /// How often a check failed and variances were raised.
    pub(in crate::navigation) fn repairs(&self) -> u64 {
        self.repairs
    }

    /// Rows, which are columns too.
    #[inline]
    pub(in crate::navigation) fn rows_mut(&mut self) -> &mut [[f64; N]; N] {
        &mut self.matrix.data.0
    }

    #[inline]
    fn rows(&self) -> &[[f64; N]; N] {
        &self.matrix.data.0
    }

    /// Forgets a state and its correlations.
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

    /// First-order Gauss–Markov step of one state: factor, then noise.
    #[inline]
    pub(in crate::navigation) fn decay(&mut self, state: usize, factor: f64, variance: f64) {
        let p = self.rows_mut();
        for j in 0..N {
            p[state][j] *= factor;
        }
        for row in p.iter_mut() {
            row[state] *= factor;
        }
        // Both passes met the diagonal.
        p[state][state] += variance;
    }

    /// Multiplies all of it: what is known is known so much less.
    pub(in crate::navigation) fn raise(&mut self, factor: f64) {
        self.matrix *= factor;
    }

    /// Keeps the first variances below limits that are as good as unknown, so that no number overflows.
    #[inline]
    pub(in crate::navigation) fn bound<const L: usize>(&mut self, limits: &[f64; L]) {
        for (i, limit) in limits.iter().enumerate() {
            let variance = self.matrix[(i, i)];
            if variance > *limit {
                self.shrink(i, sqrt(limit / variance));
            }
        }
    }

    #[cold]
    fn shrink(&mut self, state: usize, factor: f64) {
        self.decay(state, factor, 0.0);
        self.updates = CHECK_EVERY;
    }

    /// Adds to a variance.
    pub(in crate::navigation) fn inflate(&mut self, state: usize, variance: f64) {
        self.rows_mut()[state][state] += variance;
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
        // The two orders of summation round differently.
        for i in 0..3 {
            for j in 0..N {
                p[j][first + i] = p[first + i][j];
            }
        }
    }

    /// `H P`, row by row. Zeros of the Jacobian, which is most of it, cost nothing.
    #[inline]
    pub(in crate::navigation) fn project<const D: usize>(&self, jacobian: &[[f64; N]; D]) -> [[f64; N]; D] {
        let p = self.rows();
        let mut product = [[0.0; N]; D];
        for (row, factors) in product.iter_mut().zip(jacobian) {
            for (k, factor) in factors.iter().enumerate() {
                if *factor != 0.0 {
                    for j in 0..N {
                        row[j] += factor * p[k][j];
                    }
                }
            }
        }
        product
    }

    /// Decomposes `S = H P Hᵀ + R`; none if it is not positive definite.
    #[inline]
    pub(in crate::navigation) fn innovation<const D: usize>(
        &self,
        jacobian: &[[f64; N]; D],
        projected: &[[f64; N]; D],
        residual: &[f64; D],
        noise: &SMatrix<f64, D, D>,
    ) -> Option<Innovation<D, N>> {
        let mut lower = [[0.0; D]; D];
        for i in 0..D {
            for j in 0..=i {
                let mut sum = 0.0;
                for k in 0..N {
                    sum += jacobian[i][k] * projected[j][k];
                }
                let least = if i == j { LEAST_NOISE * sum } else { f64::NEG_INFINITY };
                lower[i][j] = sum + noise[(i, j)].max(least);
            }
        }
        let mut gain = *projected;
        let mut whitened = *residual;
        for i in 0..D {
            for j in 0..i {
                for k in 0..j {
                    lower[i][j] -= lower[i][k] * lower[j][k];
                }
                lower[i][j] *= lower[j][j];
                let factor = lower[i][j];
                lower[i][i] -= factor * factor;
                whitened[i] -= factor * whitened[j];
                let (above, below) = gain.split_at_mut(i);
                for k in 0..N {
                    below[0][k] -= factor * above[j][k];
                }
            }
            // Nor if it is not a number. The reciprocal of the diagonal is what the rest needs.
            if !(lower[i][i] > 0.0 && lower[i][i].is_finite()) {
                return None;
            }
            lower[i][i] = 1.0 / sqrt(lower[i][i]);
            whitened[i] *= lower[i][i];
            for value in &mut gain[i] {
                *value *= lower[i][i];
            }
        }
        let density = (0..D).map(|i| lower[i][i]).product();
        Some(Innovation { gain, whitened, density })
    }

    /// `P ← P - Wᵀ W`, the update in the order of the decomposition, one scalar after the other.
    #[inline]
    pub(in crate::navigation) fn update<const D: usize>(&mut self, innovation: &Innovation<D, N>) {
        let p = self.rows_mut();
        for gain in &innovation.gain {
            for i in 0..N {
                let factor = gain[i];
                // Both halves: the same product, so they round alike.
                for j in 0..N {
                    p[i][j] -= factor * gain[j];
                }
            }
        }
        self.updates += 1;
        if self.updates >= CHECK_EVERY || (0..N).any(|i| self.matrix[(i, i)] <= 0.0) {
            self.enforce();
        }
    }

    /// Whether a Cholesky decomposition exists.
    pub(in crate::navigation) fn is_positive_definite(&self) -> bool {
        let mut lower = self.matrix;
        for i in 0..N {
            for j in 0..=i {
                let mut sum = lower[(i, j)];
                for k in 0..j {
                    sum -= lower[(i, k)] * lower[(j, k)];
                }
                if i != j {
                    lower[(i, j)] = sum / lower[(j, j)];
                } else if sum > 0.0 && sum.is_finite() {
                    lower[(i, i)] = sqrt(sum);
                } else {
                    return false;
                }
            }
        }
        true
    }

    /// Raises variances until the matrix is positive definite.
    #[cold]
    fn enforce(&mut self) {
        self.updates = 0;
        let mut fraction = REPAIR;
        while !self.is_positive_definite() && fraction < 1.0 {
            self.repairs += 1;
            let p = self.rows_mut();
            for (i, row) in p.iter_mut().enumerate() {
                row[i] = (row[i] * (1.0 + fraction)).max(f64::MIN_POSITIVE);
            }
            fraction *= 10.0;
        }
    }
}
