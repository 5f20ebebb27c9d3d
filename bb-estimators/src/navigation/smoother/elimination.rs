//! Elimination in chronological order, from each keyframe to the next, and back-substitution.
//!
//! Given the information `Rᵀ R` of a keyframe and the [`Link`] to the next, `δ = G δ⁺ + g + ν`, eliminating δ leaves
//!
//! * `M⁺ = Gᵀ (M⁻¹ + Q)⁻¹ G = Xᵀ X` with `X = S⁻ᵀ R G` and `Sᵀ S = I + R Q Rᵀ`,
//! * `v⁺ = Xᵀ z` with `z = S⁻ᵀ (R⁻ᵀ v - R g)`.
//!
//! Everything is a sum of squares, so no digits cancel at any ratio of magnitudes. R and Q may
//! have zeros, for example in undetermined directions. The newest keyframe comes last, so its pivot gives its covariance.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use super::link::{Information, Link};
use super::matrix::{
    Root, Square, add_gram, axpy, dot, lower_root, mirror, times, transpose_times, transposed, zeros,
};
use crate::navigation::factor::{MOST_ROWS, Rows};
use crate::navigation::fused::Judged;
use crate::navigation::math::ln;

/// Transformation of a keyframe's ties to later poses by its elimination.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Carried<const N: usize> {
    /// `Gᵀ (I + M Q)⁻¹`, for the next keyframe.
    pub(super) carry: Square<N>,
    /// A square root of Q': `rootᵀ root = Q'`; a lower triangle.
    pub(super) noise_root: Square<N>,
    /// `g + Q' (v - M g)`: the correction of this keyframe if that of the next were zero.
    pub(super) at: [f64; N],
}

/// See [`Pivot::respond`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Response<const N: usize> {
    /// `R⁻ᵀ v`.
    pub(super) mean: [f64; N],
    /// The vector that, multiplied by the ties, is subtracted from the later poses.
    pub(super) at: [f64; N],
    /// The information vector passed to the next keyframe.
    pub(super) next: [f64; N],
}

/// An eliminated keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pivot<const N: usize> {
    /// R.
    pub(super) root: Root<N>,
    /// `R⁻ᵀ v`.
    pub(super) mean: [f64; N],
    /// S; unspecified for the last keyframe.
    inner: Root<N>,
    /// X.
    through: Square<N>,
}

impl<const N: usize> Pivot<N> {
    pub(super) const fn none() -> Self {
        Self { root: Root::zeros(), mean: [0.0; N], inner: Root::zeros(), through: zeros() }
    }

    /// Factors the information of the keyframe.
    #[inline]
    pub(super) fn take(&mut self, known: &Information<N>) {
        self.root = Root::of(&known.matrix);
        self.mean = self.root.solve_transposed(&known.vector);
    }

    /// Eliminates the keyframe and returns the information on the next.
    pub(super) fn eliminate(&mut self, link: &Link<N>) -> Information<N> {
        let by_noise = self.root.times_rows(&link.noise);
        let across = transposed(&self.root.upper);
        let mut inner = zeros();
        for i in 0..N {
            let row: &mut [f64; N] = &mut inner[i];
            row[i] = 1.0;
            // Only entries on and above the diagonal are read; in those, the terms with k < i are zero, as R is upper triangular.
            for k in i..N {
                axpy(row, by_noise[i][k], &across[k]);
            }
        }
        self.inner = Root::of(&inner);
        self.through = self.inner.solve_transposed_rows(&self.root.times_rows(&link.back));
        let mut z = self.mean;
        for i in 0..N {
            z[i] -= dot(&self.root.upper[i], &link.offset);
        }
        let z = self.inner.solve_transposed(&z);
        let mut message = link.information;
        add_gram(&mut message.matrix, &self.through);
        axpy(&mut message.vector, 1.0, &transpose_times(&self.through, &z));
        message
    }

    /// The effect of the elimination on the ties to later poses, after [`eliminate`](Self::eliminate); see
    /// `coupling.rs`.
    pub(super) fn carried(&self, link: &Link<N>) -> Carried<N> {
        let mut identity = zeros();
        for i in 0..N {
            identity[i][i] = 1.0;
        }
        // Xᵀ S⁻ᵀ R⁻ᵀ
        let lower = self.inner.solve_transposed_rows(&self.root.solve_transposed_rows(&identity));
        let mut carry = zeros();
        for k in 0..N {
            for i in 0..N {
                axpy(&mut carry[i], self.through[k][i], &lower[k]);
            }
        }
        // Q' = Lᵀ (I + L M Lᵀ)⁻¹ L with Q = Lᵀ L: nothing cancels. With a lower triangle L, its root is one as well.
        let noise = lower_root(&link.noise);
        let weighted = self.root.times_rows(&transposed(&noise));
        let mut inner = identity;
        add_gram(&mut inner, &weighted);
        let noise_root = Root::of(&inner).solve_transposed_rows(&noise);
        let mut rest = self.mean;
        for i in 0..N {
            rest[i] -= dot(&self.root.upper[i], &link.offset);
        }
        let rest = transpose_times(&self.root.upper, &rest);
        let mut at = link.offset;
        axpy(&mut at, 1.0, &transpose_times(&noise_root, &times(&noise_root, &rest)));
        Carried { carry, noise_root, at }
    }

    /// The response of this keyframe and the next to the information vector `arrived`, with all others zero.
    pub(super) fn respond(&self, link: &Link<N>, arrived: &[f64; N]) -> Response<N> {
        let mean = self.root.solve_transposed(arrived);
        let half = self.inner.solve_transposed(&mean);
        let weighted = transpose_times(&self.root.upper, &self.inner.solve(&half));
        Response { mean, at: times(&link.noise, &weighted), next: transpose_times(&self.through, &half) }
    }

    /// The mean of this keyframe for such a response; the counterpart of `back_pulled`.
    pub(super) fn respond_back(
        &self,
        mean: &[f64; N],
        link: &Link<N>,
        next: &[f64; N],
        pull: &[f64; N],
    ) -> [f64; N] {
        let mut mean = *mean;
        axpy(&mut mean, -1.0, &self.root.solve_transposed(pull));
        self.back_from(&mean, link, &[0.0; N], next)
    }

    /// The mean of the newest keyframe.
    pub(super) fn newest(&self) -> [f64; N] {
        self.root.solve(&self.mean)
    }

    /// The mean of this keyframe, given that of the next.
    #[inline]
    pub(super) fn back(&self, link: &Link<N>, next: &[f64; N]) -> [f64; N] {
        self.back_from(&self.mean, link, &link.offset, next)
    }

    /// Returns the mean of this keyframe, given that of the next, if the keyframe also has ties to later poses, where `pull` is `C P`.
    pub(super) fn back_pulled(&self, link: &Link<N>, next: &[f64; N], pull: &[f64; N]) -> [f64; N] {
        let mut mean = self.mean;
        axpy(&mut mean, -1.0, &self.root.solve_transposed(pull));
        self.back_from(&mean, link, &link.offset, next)
    }

    #[inline]
    fn back_from(&self, known: &[f64; N], link: &Link<N>, offset: &[f64; N], next: &[f64; N]) -> [f64; N] {
        let mut mean = times(&link.back, next);
        axpy(&mut mean, 1.0, offset);
        let mut missing = *known;
        for i in 0..N {
            missing[i] -= dot(&self.root.upper[i], &mean);
        }
        let missing = self.inner.solve(&self.inner.solve_transposed(&missing));
        let correction = times(&link.noise, &transpose_times(&self.root.upper, &missing));
        axpy(&mut mean, 1.0, &correction);
        mean
    }

    /// The covariance of this keyframe, given that of the next.
    ///
    /// H. E. Rauch, F. Tung, C. T. Striebel, "Maximum likelihood estimates of linear dynamic systems", AIAA Journal 3(8),
    /// 1965, with the noise in Joseph's form.
    pub(super) fn covariance_back(&self, link: &Link<N>, next: &Square<N>) -> Square<N> {
        // D⁻¹ R Q, and with it I - K.
        let whitened = self.inner.solve_transposed_rows(&self.root.times_rows(&link.noise));
        let mut weighted = zeros();
        let inverse = self.inner.inverse();
        let projected = self.root.times_rows(&link.noise);
        for i in 0..N {
            for k in 0..N {
                axpy(&mut weighted[i], inverse[i][k], &projected[k]);
            }
        }
        let whitened_root = self.inner.solve_transposed_rows(&self.root.upper);
        let mut kept = zeros();
        for i in 0..N {
            kept[i][i] = 1.0;
        }
        for k in 0..N {
            for i in 0..N {
                axpy(&mut kept[i], -whitened[k][i], &whitened_root[k]);
            }
        }
        let mut gain = zeros();
        for i in 0..N {
            for k in 0..N {
                axpy(&mut gain[i], kept[i][k], &link.back[k]);
            }
        }
        let mut covariance = sandwich(&gain, next);
        let noise = sandwich(&kept, &link.noise);
        for i in 0..N {
            axpy(&mut covariance[i], 1.0, &noise[i]);
        }
        add_gram(&mut covariance, &weighted);
        mirror(&mut covariance);
        covariance
    }
}

/// `A M Aᵀ`.
fn sandwich<const N: usize>(outer: &Square<N>, inner: &Square<N>) -> Square<N> {
    let mut product = zeros();
    for i in 0..N {
        let mut row = [0.0; N];
        for k in 0..N {
            axpy(&mut row, outer[i][k], &inner[k]);
        }
        for j in 0..N {
            product[i][j] = dot(&row, &outer[j]);
        }
    }
    product
}

/// The uncertainty of a keyframe when one of its measurements is gated.
pub(super) enum Known<'a, const N: usize> {
    /// The pivot of the newest keyframe.
    Newest(&'a Root<N>),
    /// The covariance of any other keyframe.
    Other(&'a Square<N>),
}

impl<const N: usize> Known<'_, N> {
    /// Adds `H P Hᵀ` to `sum`, on and below the diagonal.
    fn add_to(&self, rows: &[[f64; N]], sum: &mut [[f64; MOST_ROWS]; MOST_ROWS]) {
        for (i, row) in rows.iter().enumerate() {
            match self {
                Self::Newest(root) => {
                    let projected = root.solve(&root.solve_transposed(row));
                    for j in 0..=i {
                        sum[i][j] += dot(&projected, &rows[j]);
                    }
                }
                Self::Other(covariance) => {
                    let projected = times(covariance, row);
                    for j in 0..=i {
                        sum[i][j] += dot(&projected, &rows[j]);
                    }
                }
            }
        }
    }
}

/// Compares a factor at one keyframe with its estimate.
pub(super) fn judge<const N: usize>(
    factor: &Rows<N>,
    correction: &[f64; N],
    known: &Known<'_, N>,
) -> Option<Judged> {
    let mut covariance = [[0.0; MOST_ROWS]; MOST_ROWS];
    let mut residual = factor.residual;
    for i in 0..factor.count {
        covariance[i][i] = 1.0;
        residual[i] -= dot(&factor.at[i], correction);
    }
    known.add_to(&factor.at[..factor.count], &mut covariance);
    decompose(factor, residual, covariance)
}

/// Compares a factor on a keyframe and the previous one with their estimates, given the covariance that their uncertainty gives it.
pub(super) fn judge_with<const N: usize>(
    factor: &Rows<N>,
    corrections: (&[f64; N], &[f64; N]),
    mut covariance: [[f64; MOST_ROWS]; MOST_ROWS],
) -> Option<Judged> {
    let mut residual = factor.residual;
    for i in 0..factor.count {
        covariance[i][i] += 1.0;
        residual[i] -= dot(&factor.previous[i], corrections.0) + dot(&factor.at[i], corrections.1);
    }
    decompose(factor, residual, covariance)
}

/// Judges a factor of two keyframes if no landmark ties keyframes before the later one to it or to those after it. The pivot is that of the
/// previous keyframe.
pub(super) fn judge_pair<const N: usize>(
    factor: &Rows<N>,
    before: &Pivot<N>,
    link: &Link<N>,
    corrections: (&[f64; N], &[f64; N]),
    known: &Known<'_, N>,
) -> Option<Judged> {
    let mut innovation = link.innovation(factor);
    let count = factor.count;
    // The noise between them, given the information on the previous keyframe.
    let mut whitened = [[0.0; N]; MOST_ROWS];
    for i in 0..count {
        let by_root = times(&before.root.upper, &innovation.projected[i]);
        whitened[i] = before.inner.solve_transposed(&by_root);
        for k in 0..N {
            axpy(&mut innovation.expected[i], -whitened[i][k], &before.through[k]);
        }
    }
    let mut residual = factor.residual;
    for i in 0..count {
        for j in 0..=i {
            innovation.covariance[i][j] -= dot(&whitened[i], &whitened[j]);
        }
        residual[i] -= dot(&factor.previous[i], corrections.0) + dot(&factor.at[i], corrections.1);
    }
    known.add_to(&innovation.expected[..count], &mut innovation.covariance);
    decompose(factor, residual, innovation.covariance)
}

fn decompose<const N: usize>(
    factor: &Rows<N>,
    mut residual: [f64; MOST_ROWS],
    mut lower: [[f64; MOST_ROWS]; MOST_ROWS],
) -> Option<Judged> {
    let mut judged = Judged { nis: 0.0, log_density: factor.log_density, whitened: 0.0 };
    let mut determinant = 1.0;
    for i in 0..factor.count {
        for j in 0..i {
            let mut share = lower[i][j];
            for k in 0..j {
                share -= lower[i][k] * lower[j][k];
            }
            share *= lower[j][j];
            lower[i][j] = share;
            lower[i][i] -= share * share;
            residual[i] -= share * residual[j];
        }
        // The factor's own noise has variance 1, so the pivot is not smaller, except for rounding.
        let pivot = lower[i][i].max(1e-6);
        if !pivot.is_finite() {
            return None;
        }
        determinant *= pivot;
        lower[i][i] = 1.0 / crate::navigation::math::sqrt(pivot);
        residual[i] *= lower[i][i];
        judged.nis += residual[i] * residual[i];
    }
    judged.whitened = residual[0];
    judged.log_density -= 0.5 * ln(determinant);
    judged.nis.is_finite().then_some(judged)
}
