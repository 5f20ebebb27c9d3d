//! Fusion of a linearised measurement, shared by all filters.

use super::covariance::{Covariance, Innovation};
use super::fused::{Fused, Judged};
use super::refusal::Refusal;
use super::stream::{Gate, Stream};

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
    let judged = Judged { nis: innovation.nis(), log_density: innovation.log_density(), whitened: 0.0 };
    if judged.nis.is_nan() {
        return Err(Refusal::NonFinite);
    }
    let fused = stream.weigh(&judged, innovation.dimension(), gate)?;
    if fused.weight < 1.0 {
        innovation.soften(fused.weight);
        if !innovation.decompose(covariance.matrix().as_slice()) {
            return Err(Refusal::Noise);
        }
    }
    Ok(Fused { whitened: innovation.first_whitened(), ..fused })
}
