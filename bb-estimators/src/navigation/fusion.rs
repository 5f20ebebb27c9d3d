//! Fusion of a linearised measurement, shared by all filters.

mod raising;

use super::covariance::{Covariance, Innovation};
use super::fused::Fused;
use super::layout::Layout;
use super::refusal::Refusal;
use super::stream::{Gate, Stream, Verdict};

use raising::raised_to_fit;

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
    let Verdict { weight, raised, limit, log_likelihood } =
        stream.weigh(nis, dimension, innovation.log_density(), gate)?;
    if raised > 1.0 {
        return Err(Refusal::Gate { nis, limit });
    }
    if weight < 1.0 {
        innovation.soften(weight);
        if !innovation.decompose(covariance.matrix().as_slice()) {
            return Err(Refusal::Noise);
        }
    }
    let whitened = innovation.first_whitened();
    Ok(Fused { nis, dimension, weight, raised, limit, log_likelihood, whitened, misfit: [0.0; 3] })
}

/// What a measurement observes of the position.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sight {
    /// The position in the world.
    Position,
    /// Only the height, with the errors of the vertical motion: a bit each.
    Height(u64),
    /// Only the position relative to the keyframe.
    Relative,
    /// Not the position, and of the attitude only the heading.
    Heading,
    Nothing,
}

/// A measurement that the gate has accepted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed<const N: usize> {
    nis: f64,
    verdict: Verdict,
    /// The covariance before it was raised to fit the measurement, if it was raised.
    before: Option<Covariance<N>>,
}

impl<const N: usize> Weighed<N> {
    /// Applies the gate of `stream`. If its patience has run out, the covariance is raised until the measurement fits.
    /// `sight` tells what a measurement observes of the position.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Gate`], [`Refusal::NonFinite`] or [`Refusal::Noise`]. The covariance is then unchanged.
    #[inline]
    pub(super) fn new(
        covariance: &mut Covariance<N>,
        stream: &Stream,
        innovation: &mut Innovation<'_>,
        gate: Gate,
        layout: &Layout<N>,
        sight: fn(&Innovation<'_>) -> Sight,
    ) -> Result<Self, Refusal> {
        let nis = innovation.nis();
        if nis.is_nan() {
            return Err(Refusal::NonFinite);
        }
        let verdict = stream.weigh(nis, innovation.dimension(), innovation.log_density(), gate)?;
        let mut weighed = Self { nis, verdict, before: None };
        if verdict.weight < 1.0 {
            innovation.soften(verdict.weight);
            if !innovation.decompose(covariance.matrix().as_slice()) {
                return Err(Refusal::Noise);
            }
        }
        if verdict.raised > 1.0 {
            let before = *covariance;
            weighed.before = Some(before);
            let sight = sight(innovation);
            let quantities = layout.quantities();
            let before = before.matrix().as_slice();
            if !raised_to_fit(&mut covariance.dense(), before, stream, innovation, &quantities, sight) {
                weighed.undo(covariance);
                return Err(Refusal::Gate { nis, limit: verdict.limit });
            }
        }
        Ok(weighed)
    }

    /// Restores the covariance.
    pub(super) fn undo(&self, covariance: &mut Covariance<N>) {
        if let Some(before) = self.before {
            *covariance = before;
        }
    }

    /// Whether the covariance was raised to fit the measurement.
    #[inline]
    pub(super) fn is_raised(&self) -> bool {
        self.before.is_some()
    }

    /// The outcome of the update.
    #[inline]
    pub(super) fn fused(&self, innovation: &Innovation<'_>, layout: &Layout<N>) -> Fused {
        let Verdict { weight, raised, limit, log_likelihood } = self.verdict;
        let misfit = if self.before.is_some() { misfit(innovation, layout) } else { [0.0; 3] };
        Fused {
            nis: self.nis,
            dimension: innovation.dimension(),
            weight,
            raised,
            limit,
            log_likelihood,
            whitened: innovation.first_whitened(),
            misfit,
        }
    }
}

/// The first components of a residual that observe the position. Others can have other units.
pub(super) fn misfit<const N: usize>(innovation: &Innovation<'_>, layout: &Layout<N>) -> [f64; 3] {
    raising::misfit(innovation, N, &layout.quantities())
}
