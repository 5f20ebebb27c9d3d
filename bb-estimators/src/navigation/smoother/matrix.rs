//! Dense kernels on rows of known length. The inner loops run along rows so that they vectorise.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use crate::navigation::math::sqrt;

/// `N × N`, row-major.
pub(super) type Square<const N: usize> = [[f64; N]; N];

/// A pivot below this fraction of its diagonal is rounding error: the direction is treated as unknown.
const LEAST_PIVOT: f64 = 1e-15;

pub(super) const fn zeros<const N: usize>() -> Square<N> {
    [[0.0; N]; N]
}

/// `target += factor · row`.
#[inline(always)]
pub(super) fn axpy<const N: usize>(target: &mut [f64; N], factor: f64, row: &[f64; N]) {
    for j in 0..N {
        target[j] += factor * row[j];
    }
}

#[inline(always)]
pub(super) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for j in 0..N {
        sum += a[j] * b[j];
    }
    sum
}

/// `M v`.
#[inline]
pub(super) fn times<const N: usize, const D: usize>(matrix: &[[f64; N]; D], v: &[f64; N]) -> [f64; D] {
    core::array::from_fn(|i| dot(&matrix[i], v))
}

/// `Mᵀ v`.
#[inline]
pub(super) fn transpose_times<const N: usize>(matrix: &Square<N>, v: &[f64; N]) -> [f64; N] {
    let mut product = [0.0; N];
    for k in 0..N {
        axpy(&mut product, v[k], &matrix[k]);
    }
    product
}

/// `target += Mᵀ M`, on and above the diagonal; values below it are unspecified.
#[inline]
pub(super) fn add_gram<const N: usize>(target: &mut Square<N>, matrix: &[[f64; N]]) {
    for row in matrix {
        for i in 0..N {
            if row[i] != 0.0 {
                axpy(&mut target[i], row[i], row);
            }
        }
    }
}

/// An upper triangle R with `Rᵀ R = M`, and the reciprocals of its diagonal. M is read on and above the diagonal.
///
/// A direction that M does not determine, or whose pivot is NaN, gets a row of zeros and 0 as its reciprocal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Root<const N: usize> {
    pub(super) upper: Square<N>,
    pub(super) reciprocal: [f64; N],
}

impl<const N: usize> Root<N> {
    pub(super) const fn zeros() -> Self {
        Self { upper: zeros(), reciprocal: [0.0; N] }
    }

    #[inline]
    pub(super) fn of(matrix: &Square<N>) -> Self {
        let mut upper = *matrix;
        let mut reciprocal = [0.0; N];
        for k in 0..N {
            let pivot = upper[k][k];
            let (above, below) = upper.split_at_mut(k + 1);
            let row = &mut above[k];
            // Clear the unspecified values below the diagonal.
            row[..k].fill(0.0);
            if !(pivot > LEAST_PIVOT * matrix[k][k] && pivot.is_finite()) {
                *row = [0.0; N];
                continue;
            }
            let scale = 1.0 / sqrt(pivot);
            reciprocal[k] = scale;
            for j in 0..N {
                row[j] *= scale;
            }
            for i in k + 1..N {
                axpy(&mut below[i - k - 1], -row[i], row);
            }
        }
        Self { upper, reciprocal }
    }

    /// `R⁻ᵀ v`.
    #[inline]
    pub(super) fn solve_transposed(&self, v: &[f64; N]) -> [f64; N] {
        let mut rest = *v;
        let mut solved = [0.0; N];
        for i in 0..N {
            solved[i] = rest[i] * self.reciprocal[i];
            axpy(&mut rest, -solved[i], &self.upper[i]);
        }
        solved
    }

    /// `R⁻¹ v`.
    #[inline]
    pub(super) fn solve(&self, v: &[f64; N]) -> [f64; N] {
        let mut solved = [0.0; N];
        for i in (0..N).rev() {
            let known = dot(&self.upper[i], &solved);
            solved[i] = (v[i] - known) * self.reciprocal[i];
        }
        solved
    }

    /// `R⁻ᵀ M`, row by row.
    #[inline]
    pub(super) fn solve_transposed_rows(&self, matrix: &Square<N>) -> Square<N> {
        let mut solved = *matrix;
        for i in 0..N {
            let (above, below) = solved.split_at_mut(i + 1);
            let row = &mut above[i];
            for j in 0..N {
                row[j] *= self.reciprocal[i];
            }
            for k in i + 1..N {
                axpy(&mut below[k - i - 1], -self.upper[i][k], row);
            }
        }
        solved
    }

    /// `R M`.
    #[inline]
    pub(super) fn times_rows(&self, matrix: &Square<N>) -> Square<N> {
        let mut product = zeros();
        for i in 0..N {
            let mut row = [0.0; N];
            for k in i..N {
                axpy(&mut row, self.upper[i][k], &matrix[k]);
            }
            product[i] = row;
        }
        product
    }

    /// `(Rᵀ R)⁻¹`.
    pub(super) fn inverse(&self) -> Square<N> {
        // R⁻ᵀ, whose Gram matrix is the inverse.
        let mut identity = zeros();
        for i in 0..N {
            identity[i][i] = 1.0;
        }
        let lower = self.solve_transposed_rows(&identity);
        let mut inverse = zeros();
        add_gram(&mut inverse, &lower);
        inverse
    }

    /// Returns whether every direction is determined.
    pub(super) fn is_regular(&self) -> bool {
        self.reciprocal.iter().all(|x| *x > 0.0)
    }
}

/// A lower triangle L with `Lᵀ L = M`, which is read on and above the diagonal. A direction in which M is zero gets a row of
/// zeros.
pub(super) fn lower_root<const N: usize>(matrix: &Square<N>) -> Square<N> {
    let mut lower = *matrix;
    mirror(&mut lower);
    for k in (0..N).rev() {
        let pivot = lower[k][k];
        let (above, below) = lower.split_at_mut(k);
        let row = &mut below[0];
        row[k + 1..].fill(0.0);
        if !(pivot > LEAST_PIVOT * matrix[k][k] && pivot.is_finite()) {
            *row = [0.0; N];
            continue;
        }
        let scale = 1.0 / sqrt(pivot);
        row.iter_mut().for_each(|x| *x *= scale);
        for i in 0..k {
            axpy(&mut above[i], -row[i], row);
        }
    }
    lower
}

/// Copies the upper half to the lower.
pub(super) fn mirror<const N: usize>(matrix: &mut Square<N>) {
    for i in 0..N {
        for j in 0..i {
            matrix[i][j] = matrix[j][i];
        }
    }
}

pub(super) fn transposed<const N: usize>(matrix: &Square<N>) -> Square<N> {
    core::array::from_fn(|i| core::array::from_fn(|j| matrix[j][i]))
}
