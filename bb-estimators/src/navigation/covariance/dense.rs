//! Rare operations on a covariance, compiled once for those of all sizes.

use crate::navigation::math::sqrt;
use crate::navigation::state::MOST_ERRORS;

/// The smallest eigenvalue of the correlations that a check accepts: above rounding, and below the noise that a sample adds.
const LEAST: f64 = 1e-14;

/// The relative amount by which variances are raised when a check fails.
const REPAIR: f64 = 1e-12;

/// A covariance of `n` errors, of the size that it has when the program runs.
#[derive(Debug)]
pub(in crate::navigation) struct Dense<'a> {
    pub(super) n: usize,
    /// `n × n`.
    pub(super) p: &'a mut [f64],
    pub(super) updates: &'a mut u32,
    pub(super) repairs: &'a mut u64,
}

impl Dense<'_> {
    pub(in crate::navigation) fn at(&self, i: usize, j: usize) -> f64 {
        self.p[i * self.n + j]
    }

    fn at_mut(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.p[i * self.n + j]
    }

    /// Clamps variances to these limits.
    #[cold]
    pub(super) fn shrink(&mut self, limits: &[f64]) {
        for (i, limit) in limits.iter().enumerate() {
            let variance = self.at(i, i);
            if variance > *limit {
                let factor = sqrt(limit / variance);
                for j in 0..self.n {
                    *self.at_mut(i, j) *= factor;
                    *self.at_mut(j, i) *= factor;
                }
                // Rounding must not leave it above the bound.
                *self.at_mut(i, i) = *limit;
            }
        }
        self.enforce();
    }

    /// Raises variances until the matrix is positive definite.
    #[cold]
    pub(super) fn enforce(&mut self) {
        *self.updates = 0;
        let n = self.n;
        let mut fraction = REPAIR;
        while !is_regular(n, self.p, LEAST) {
            *self.repairs += 1;
            if fraction > 1.0 {
                // Only the variances are more than rounding here.
                for i in 0..n {
                    (0..n).filter(|j| *j != i).for_each(|j| *self.at_mut(i, j) = 0.0);
                }
            }
            for i in 0..n {
                // A covariance is at most the state's own variance, except for rounding.
                let shared = (0..n).filter(|j| *j != i && self.at(*j, *j) > 0.0);
                let shared = shared.map(|j| self.at(i, j) * self.at(i, j) / self.at(j, j));
                let least = shared.fold(f64::MIN_POSITIVE, f64::max);
                let variance = self.at(i, i);
                *self.at_mut(i, i) = if variance > 0.0 { variance * (1.0 + fraction) } else { least };
            }
            fraction *= 10.0;
        }
    }
}

/// Returns whether every eigenvalue of the correlations is at least this large: whether a Cholesky decomposition exists after this
/// fraction of each variance is subtracted.
///
/// The pivots alone are not enough. With three positions whose sum is known and a fourth state equal to that sum, each pivot
/// is a small fraction of the previous one, and the smallest eigenvalue is their product.
#[cold]
pub(super) fn is_regular(n: usize, p: &[f64], margin: f64) -> bool {
    let mut lower = [[0.0; MOST_ERRORS]; MOST_ERRORS];
    for i in 0..n {
        for j in 0..i {
            let mut sum = p[i * n + j];
            for k in 0..j {
                sum -= lower[i][k] * lower[j][k];
            }
            lower[i][j] = sum / lower[j][j];
        }
        let mut pivot = p[i * n + i] * (1.0 - margin);
        for k in 0..i {
            pivot -= lower[i][k] * lower[i][k];
        }
        // Also rejects NaN.
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        lower[i][i] = sqrt(pivot);
    }
    true
}
