//! The error covariance: exactly symmetric, and kept positive definite.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector3};

use super::layout::Layout;
use super::math::{ln, sqrt};

/// The smallest ratio of the variance in a direction that one update may leave. The rounding error, 1e-16 of the variance
/// before, stays far below the variance after.
const LEAST_NOISE: f64 = 1e-10;

/// The smallest ratio that several updates may leave of the variances of the measured terms. If a sum or difference is known even
/// better relative to its terms, rounding would consume the rest.
const LEAST_REST: f64 = 1e-13;

/// If an update leaves less than this ratio of a variance, rounding may consume the rest, and the covariance is checked at once.
const RISKY: f64 = 1e-8;

/// Number of updates between two checks by a Cholesky decomposition.
const CHECK_EVERY: u32 = 1024;

/// The smallest eigenvalue of the correlations that a check accepts: above rounding, and below the noise that a sample adds.
const LEAST: f64 = 1e-14;

/// The relative amount by which variances are raised when a check fails.
const REPAIR: f64 = 1e-12;

/// Rounding error of a computed covariance, relative to the variances.
const ROUNDING: f64 = 1e-9;

/// Whether a matrix is a covariance: symmetric, and positive semi-definite up to rounding. The zero matrix, which describes
/// exactly known errors, is valid.
#[allow(clippy::neg_cmp_op_on_partial_ord, reason = "what is not a number is refused")]
#[inline]
pub(in crate::navigation) fn is_covariance<const D: usize>(noise: &SMatrix<f64, D, D>) -> bool {
    let mut lower = [[0.0; D]; D];
    let mut pivots = [0.0; D];
    for i in 0..D {
        let least = ROUNDING * noise[(i, i)];
        for j in 0..i {
            // Also rejects NaN.
            let largest = ROUNDING * (noise[(i, i)] * noise[(j, j)]);
            let apart = noise[(i, j)] - noise[(j, i)];
            if !(apart * apart <= largest) {
                return false;
            }
            let mut rest = noise[(i, j)];
            for k in 0..j {
                rest -= lower[i][k] * pivots[k] * lower[j][k];
            }
            if pivots[j] > 0.0 {
                lower[i][j] = rest / pivots[j];
            } else if !(rest * rest <= largest) {
                return false;
            }
        }
        let mut pivot = noise[(i, i)];
        for k in 0..i {
            pivot -= lower[i][k] * lower[i][k] * pivots[k];
        }
        if !(pivot >= -least) {
            return false;
        }
        pivots[i] = if pivot > least { pivot } else { 0.0 };
    }
    true
}

/// Covariance of `N` errors, in the squares of their units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::navigation) struct Covariance<const N: usize> {
    matrix: SMatrix<f64, N, N>,
    updates: u32,
    repairs: u64,
}

/// A decomposed innovation.
#[derive(Clone, Copy, Debug)]
pub(in crate::navigation) struct Innovation<const D: usize, const N: usize> {
    /// `L⁻¹ H P`, with `L Lᵀ = H P Hᵀ + R`.
    gain: [[f64; N]; D],
    /// `L⁻¹` times the residual: standard normal if model and measurement agree.
    pub(in crate::navigation) whitened: [f64; D],
    /// `det S` to the power of -½.
    density: f64,
    /// Whether the update leaves next to nothing of a variance.
    is_risky: bool,
}

impl<const D: usize, const N: usize> Innovation<D, N> {
    /// Normalised innovation squared.
    pub(in crate::navigation) fn nis(&self) -> f64 {
        self.whitened.iter().map(|x| x * x).sum()
    }

    /// The conditional mean of the errors, given the residual.
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

    /// Scales the covariance of a block of states and zeroes its correlations with all other states, so that neither carries
    /// information about the other.
    pub(in crate::navigation) fn raise(&mut self, layout: &Layout<N>, block: u8, factor: f64) {
        let blocks = &layout.blocks;
        for i in 0..N {
            for j in 0..N {
                match (blocks[i] == block, blocks[j] == block) {
                    (true, true) => self.rows_mut()[i][j] *= factor,
                    (false, false) => {}
                    _ => self.rows_mut()[i][j] = 0.0,
                }
            }
        }
        self.bound(layout);
    }

    /// Scales the covariance of some states. Their correlation coefficients, also with other states, remain.
    pub(in crate::navigation) fn scale(&mut self, layout: &Layout<N>, states: &[bool; N], factor: f64) {
        let scales = states.map(|is_scaled| if is_scaled { sqrt(factor) } else { 1.0 });
        for (row, scale) in self.rows_mut().iter_mut().zip(scales) {
            row.iter_mut().zip(scales).for_each(|(x, other)| *x *= scale * other);
        }
        self.bound(layout);
    }

    /// Clamps variances to bounds that amount to unknown, so that no number overflows.
    #[inline]
    pub(in crate::navigation) fn bound(&mut self, layout: &Layout<N>) {
        if self.is_lost(layout) {
            self.shrink(&layout.largest);
        }
    }

    #[inline]
    fn is_lost(&self, layout: &Layout<N>) -> bool {
        (0..N).any(|i| self.matrix[(i, i)] > layout.lost[i])
    }

    #[cold]
    fn shrink(&mut self, limits: &[f64; N]) {
        for (i, limit) in limits.iter().enumerate() {
            let variance = self.matrix[(i, i)];
            if variance > *limit {
                self.decay(i, sqrt(limit / variance), 0.0);
                // Rounding must not leave it above the bound.
                self.rows_mut()[i][i] = *limit;
            }
        }
        self.enforce();
    }

    /// Restores the covariances between those states that are held. The others keep what an update has made of them: together a covariance,
    /// since that differs from one by `P_h Hᵀ S⁻¹ H P_h`.
    #[cold]
    pub(in crate::navigation) fn restore(&mut self, before: &Self, is_held: impl Fn(usize) -> bool) {
        for i in (0..N).filter(|i| is_held(*i)) {
            for j in (0..N).filter(|j| is_held(*j)) {
                self.rows_mut()[i][j] = before.rows()[i][j];
            }
        }
    }

    /// Adds to a variance.
    pub(in crate::navigation) fn inflate(&mut self, state: usize, variance: f64) {
        self.rows_mut()[state][state] += variance;
    }

    /// Adds a common error of three states each, of unit variance times these vectors: `P ← P + v vᵀ`.
    pub(in crate::navigation) fn inflate_along(&mut self, parts: &[(usize, Vector3<f64>)]) {
        let mut along = [0.0; N];
        for (first, part) in parts {
            along[*first..first + 3].copy_from_slice(part.as_slice());
        }
        for (row, x) in self.rows_mut().iter_mut().zip(along) {
            row.iter_mut().zip(along).for_each(|(entry, y)| *entry += x * y);
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

    /// Computes `H P` row by row. Zeros, which make up most of the Jacobian, are skipped.
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

    /// Decomposes `S = H P Hᵀ + R`; `None` if it is not positive definite.
    #[inline]
    pub(in crate::navigation) fn innovation<const D: usize>(
        &self,
        jacobian: &[[f64; N]; D],
        projected: &[[f64; N]; D],
        residual: &[f64; D],
        noise: &SMatrix<f64, D, D>,
    ) -> Option<Innovation<D, N>> {
        let mut lower = [[0.0; D]; D];
        let mut is_risky = false;
        for i in 0..D {
            for j in 0..=i {
                let mut sum = 0.0;
                for k in 0..N {
                    sum += jacobian[i][k] * projected[j][k];
                }
                lower[i][j] = sum + noise[(i, j)];
                if i == j {
                    let mut terms = 0.0;
                    for k in 0..N {
                        terms += jacobian[i][k] * jacobian[i][k] * self.matrix[(k, k)];
                    }
                    let noise = noise[(i, i)].max(LEAST_NOISE * sum).max(LEAST_REST * terms);
                    lower[i][i] = sum + noise;
                    is_risky |= noise < RISKY * terms;
                }
            }
        }
        let mut gain = *projected;
        let mut whitened = *residual;
        for i in 0..D {
            let variance = lower[i][i];
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
            // Also rejects NaN. The remaining steps use the reciprocal of the diagonal.
            if !(lower[i][i] > 0.0 && lower[i][i].is_finite()) {
                return None;
            }
            is_risky |= lower[i][i] < RISKY * variance;
            lower[i][i] = 1.0 / sqrt(lower[i][i]);
            whitened[i] *= lower[i][i];
            for value in &mut gain[i] {
                *value *= lower[i][i];
            }
        }
        let density = (0..D).map(|i| lower[i][i]).product();
        Some(Innovation { gain, whitened, density, is_risky })
    }

    /// `P ← P - Wᵀ W`: the update in the order of the decomposition, one scalar at a time.
    #[inline]
    pub(in crate::navigation) fn update<const D: usize>(&mut self, innovation: &Innovation<D, N>) {
        let p = self.rows_mut();
        for gain in &innovation.gain {
            for i in 0..N {
                let factor = gain[i];
                // Both halves use the same product, so they round alike.
                for j in 0..N {
                    p[i][j] -= factor * gain[j];
                }
            }
        }
        self.updates += 1;
        if innovation.is_risky || (0..N).any(|i| self.matrix[(i, i)] <= 0.0) {
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

    /// Whether a Cholesky decomposition exists.
    pub(in crate::navigation) fn is_positive_definite(&self) -> bool {
        self.is_regular(0.0)
    }

    /// Whether every eigenvalue of the correlations is at least this large: whether a Cholesky decomposition exists after this
    /// fraction of each variance is subtracted.
    ///
    /// The pivots alone are not enough. With three positions whose sum is known and a fourth state equal to that sum, each pivot
    /// is a small fraction of the previous one, and the smallest eigenvalue is their product.
    fn is_regular(&self, margin: f64) -> bool {
        let mut lower = self.matrix;
        for i in 0..N {
            for j in 0..i {
                let mut sum = lower[(i, j)];
                for k in 0..j {
                    sum -= lower[(i, k)] * lower[(j, k)];
                }
                lower[(i, j)] = sum / lower[(j, j)];
            }
            let mut pivot = self.matrix[(i, i)] * (1.0 - margin);
            for k in 0..i {
                pivot -= lower[(i, k)] * lower[(i, k)];
            }
            // Also rejects NaN.
            if !(pivot > 0.0 && pivot.is_finite()) {
                return false;
            }
            lower[(i, i)] = sqrt(pivot);
        }
        true
    }

    /// Raises variances until the matrix is positive definite.
    #[cold]
    pub(in crate::navigation) fn enforce(&mut self) {
        self.updates = 0;
        let mut fraction = REPAIR;
        while !self.is_regular(LEAST) {
            self.repairs += 1;
            if fraction > 1.0 {
                // Only the variances are more than rounding here.
                self.matrix = SMatrix::from_diagonal(&self.matrix.diagonal());
            }
            for i in 0..N {
                let row = self.matrix.row(i);
                // A covariance is at most the state's own variance, except for rounding.
                let shared = (0..N).filter(|j| *j != i && self.matrix[(*j, *j)] > 0.0);
                let shared = shared.map(|j| row[j] * row[j] / self.matrix[(j, j)]);
                let least = shared.fold(f64::MIN_POSITIVE, f64::max);
                let variance = self.matrix[(i, i)];
                self.matrix[(i, i)] = if variance > 0.0 { variance * (1.0 + fraction) } else { least };
            }
            fraction *= 10.0;
        }
    }
}
