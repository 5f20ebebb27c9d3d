//! Fusion of a linearised measurement, shared by all filters.

use super::covariance::{Covariance, Innovation};
use super::fused::Fused;
use super::refusal::Refusal;
use super::stream::{Gate, Stream, Verdict};

/// Applies the gate of a stream to an innovation, and weakens what is far off.
///
/// # Errors
///
/// Returns [`Refusal::Gate`], [`Refusal::NonFinite`] or [`Refusal::Noise`].
#[inline]
pub(super) fn weighed<const N: usize>(
    covariance: &Covariance<N>,
    stream: &Stream,
    innovation: &mut Innovation<'_>,
    gate: Gate,
) -> Result<Fused, Refusal> {
    let (nis, dimension) = (innovation.nis(), innovation.dimension());
    if nis.is_nan() {
        return Err(Refusal::NonFinite);
    }
    let Verdict { weight, limit, log_likelihood } = stream.weigh(nis, dimension, innovation.log_density(), gate)?;
    if weight < 1.0 {
        innovation.soften(weight);
        if !innovation.decompose(covariance.matrix().as_slice()) {
            return Err(Refusal::Noise);
        }
    }
    let whitened = innovation.first_whitened();
    Ok(Fused { nis, dimension, weight, limit, log_likelihood, whitened })
}
