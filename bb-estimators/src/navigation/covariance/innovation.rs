//! The innovation of a linearised measurement.

#![allow(clippy::needless_range_loop, reason = "the indices are those of the equations")]

use nalgebra::{SMatrix, SVector};

use crate::navigation::math::{ln, sqrt};
use crate::navigation::measurement::Linearised;
use crate::navigation::refusal::Refusal;

/// The smallest ratio of the variance in a direction that one update may leave. The rounding error, 1e-16 of the variance
/// before, stays far below the variance after.
const LEAST_NOISE: f64 = 1e-10;

/// The smallest ratio that several updates may leave of the variances of the measured terms. If a sum or difference is known even
/// better relative to its terms, rounding would consume the rest.
const LEAST_REST: f64 = 1e-13;

/// Ratio of a variance to what an update leaves of it, below which rounding may consume the rest, and the covariance is checked at once.
const RISKY: f64 = 1e-8;

/// Rounding error of a computed covariance, relative to the variances.
const ROUNDING: f64 = 1e-9;

/// A linearised measurement, and room for its innovation.
#[derive(Debug)]
pub(in crate::navigation) struct Room<const D: usize, const N: usize> {
    pub(in crate::navigation) model: Linearised<D, N>,
    lower: [[f64; D]; D],
    gain: [[f64; N]; D],
    whitened: [f64; D],
}

impl<const D: usize, const N: usize> Room<D, N> {
    #[inline]
    pub(in crate::navigation) fn new() -> Self {
        Self { model: Linearised::new(), lower: [[0.0; D]; D], gain: [[0.0; N]; D], whitened: [0.0; D] }
    }

    /// The innovation of the model, with its noise multiplied.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::NonFinite`], or [`Refusal::Noise`] if the noise or what the innovation has of it is no covariance.
    #[inline]
    pub(super) fn innovation(&mut self, p: &[[f64; N]; N], noise_factor: f64) -> Result<Innovation<'_>, Refusal> {
        let Self { model: Linearised { residual, jacobian, noise }, lower, gain, whitened } = self;
        if !are_finite(residual) || !are_finite(jacobian.as_flattened()) || !are_finite(noise.as_slice()) {
            return Err(Refusal::NonFinite);
        }
        if !is_covariance(noise) {
            return Err(Refusal::Noise);
        }
        *noise *= noise_factor;
        *whitened = *residual;
        let (density, is_risky) =
            decompose(p, jacobian, &noise.data.0, lower, gain, whitened).ok_or(Refusal::Noise)?;
        Ok(Innovation {
            residual,
            jacobian: jacobian.as_flattened(),
            noise: noise.data.0.as_flattened_mut(),
            lower: lower.as_flattened_mut(),
            gain: gain.as_flattened_mut(),
            whitened,
            density,
            is_risky,
            decompose: decompose_again::<D, N>,
        })
    }
}

/// A linearised measurement with its innovation.
///
/// Its dimension is no parameter of the type, so that what fuses it is compiled once for a filter, and what is rarely needed once
/// for all filters.
#[derive(Debug)]
pub(in crate::navigation) struct Innovation<'a> {
    residual: &'a [f64],
    /// H, row by row.
    jacobian: &'a [f64],
    /// R.
    noise: &'a mut [f64],
    /// L, with `L Lᵀ = H P Hᵀ + R`, row by row, and the reciprocals of its diagonal.
    lower: &'a mut [f64],
    /// `L⁻¹ H P`, row by row.
    gain: &'a mut [f64],
    /// `L⁻¹` times the residual: standard normal if model and measurement agree.
    whitened: &'a mut [f64],
    /// `det S` to the power of -½.
    density: f64,
    /// True if the update leaves next to nothing of a variance.
    is_risky: bool,
    /// Computes the rest of the fields from the first three and a covariance.
    decompose: fn(&mut Innovation<'_>, &[f64]) -> Option<()>,
}

impl Innovation<'_> {
    /// The number of components.
    #[inline]
    pub(in crate::navigation) fn dimension(&self) -> usize {
        self.residual.len()
    }

    /// The rows of H, of `n` errors.
    #[inline]
    pub(in crate::navigation) fn rows(&self, n: usize) -> impl Iterator<Item = &[f64]> {
        self.jacobian.chunks_exact(n)
    }

    /// The rows of `L⁻¹ H P`.
    #[inline]
    pub(in crate::navigation) fn gain<const N: usize>(&self) -> &[[f64; N]] {
        self.gain.as_chunks().0
    }

    #[inline]
    pub(in crate::navigation) fn is_risky(&self) -> bool {
        self.is_risky
    }

    /// The first component of the whitened residual.
    #[inline]
    pub(in crate::navigation) fn first_whitened(&self) -> f64 {
        self.whitened.first().copied().unwrap_or(0.0)
    }

    /// Normalised innovation squared.
    #[inline]
    pub(in crate::navigation) fn nis(&self) -> f64 {
        self.whitened.iter().map(|x| x * x).sum()
    }

    /// `-½ ln det S`.
    pub(in crate::navigation) fn log_density(&self) -> f64 {
        ln(self.density)
    }

    /// The conditional mean of the errors, given the residual.
    #[inline]
    pub(in crate::navigation) fn mean<const N: usize>(&self) -> SVector<f64, N> {
        let mut mean = SVector::<f64, N>::zeros();
        for (gain, whitened) in self.gain::<N>().iter().zip(self.whitened.iter()) {
            for i in 0..N {
                mean[i] += gain[i] * whitened;
            }
        }
        mean
    }

    /// Gives the measurement less weight.
    pub(in crate::navigation) fn soften(&mut self, weight: f64) {
        self.noise.iter_mut().for_each(|x| *x /= weight);
    }

    /// Computes it again for a covariance, row by row, or a noise that has changed since. `false` if S is not positive definite.
    #[cold]
    pub(in crate::navigation) fn decompose(&mut self, p: &[f64]) -> bool {
        (self.decompose)(self, p).is_some()
    }
}

#[cold]
fn decompose_again<const D: usize, const N: usize>(innovation: &mut Innovation<'_>, p: &[f64]) -> Option<()> {
    let Innovation { residual, jacobian, noise, lower, gain, whitened, .. } = innovation;
    whitened.copy_from_slice(residual);
    let (density, is_risky) = decompose::<D, N>(
        p.as_chunks().0.as_array()?,
        jacobian.as_chunks().0.as_array()?,
        noise.as_chunks().0.as_array()?,
        lower.as_chunks_mut().0.as_mut_array()?,
        gain.as_chunks_mut().0.as_mut_array()?,
        whitened.as_mut_array()?,
    )?;
    (innovation.density, innovation.is_risky) = (density, is_risky);
    Some(())
}

/// Decomposes `S = H P Hᵀ + R`: fills `lower` and `gain`, and whitens the residual. Returns `det S` to the power of -½, and whether the
/// update leaves next to nothing of a variance; `None` if S is not positive definite.
#[inline(never)]
fn decompose<const D: usize, const N: usize>(
    p: &[[f64; N]; N],
    jacobian: &[[f64; N]; D],
    noise: &[[f64; D]; D],
    lower: &mut [[f64; D]; D],
    gain: &mut [[f64; N]; D],
    whitened: &mut [f64; D],
) -> Option<(f64, bool)> {
    // H P row by row. Zeros, which make up most of the Jacobian, are skipped.
    for (row, factors) in gain.iter_mut().zip(jacobian) {
        let mut sum = [0.0; N];
        for (k, factor) in factors.iter().enumerate() {
            if *factor != 0.0 {
                for j in 0..N {
                    sum[j] += factor * p[k][j];
                }
            }
        }
        *row = sum;
    }
    let mut is_risky = false;
    for i in 0..D {
        for j in 0..=i {
            let mut sum = 0.0;
            for k in 0..N {
                sum += jacobian[i][k] * gain[j][k];
            }
            lower[i][j] = sum + noise[j][i];
            if i == j {
                let mut terms = 0.0;
                for k in 0..N {
                    terms += jacobian[i][k] * jacobian[i][k] * p[k][k];
                }
                let noise = noise[i][i].max(LEAST_NOISE * sum).max(LEAST_REST * terms);
                lower[i][i] = sum + noise;
                is_risky |= noise < RISKY * terms;
            }
        }
    }
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
    Some(((0..D).map(|i| lower[i][i]).product(), is_risky))
}

/// Returns whether all are numbers and none is infinite. Without branches, so that it is vectorised: an exponent of ones carries to the
/// highest bit.
#[inline(always)]
fn are_finite(values: &[f64]) -> bool {
    const EXPONENT: u64 = f64::INFINITY.to_bits();
    const ONE: u64 = 1 << (f64::MANTISSA_DIGITS - 1);
    values.iter().fold(0, |all, x| all | ((x.to_bits() & EXPONENT) + ONE)) >> (u64::BITS - 1) == 0
}

/// Returns whether a matrix is a covariance: symmetric, and positive semi-definite up to rounding. The zero matrix, which describes
/// exactly known errors, is valid.
#[allow(clippy::neg_cmp_op_on_partial_ord, reason = "what is not a number is refused")]
#[inline(always)]
fn is_covariance<const D: usize>(noise: &SMatrix<f64, D, D>) -> bool {
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
