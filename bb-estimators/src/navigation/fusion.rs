//! How a linearised measurement is weighed, for every filter alike.

use super::covariance::{Covariance, Innovation};
use super::fused::Fused;
use super::measurement::Linearised;
use super::refusal::Refusal;
use super::stream::{Gate, Stream, Verdict};

/// A measurement that the gate has let pass, with what it does to the errors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed<const D: usize, const N: usize> {
    pub(super) innovation: Innovation<D, N>,
    nis: f64,
    verdict: Verdict,
    /// The covariance before it was raised to fit the measurement, if it was.
    before: Option<Covariance<N>>,
}

/// The model with the noise that its stream takes it to have.
#[inline]
pub(super) fn prepared<const D: usize, const N: usize>(
    mut model: Linearised<D, N>,
    stream: &Stream,
) -> Result<Linearised<D, N>, Refusal> {
    let is_finite = |row: &[f64]| row.iter().all(|x| x.is_finite());
    if !is_finite(&model.residual)
        || !model.jacobian.iter().all(|row| is_finite(row))
        || !is_finite(model.noise.as_slice())
    {
        return Err(Refusal::NonFinite);
    }
    if (0..D).any(|i| model.noise[(i, i)] < 0.0) {
        return Err(Refusal::Noise);
    }
    model.noise *= stream.noise_factor();
    Ok(model)
}

/// The innovation of a model, decomposed.
#[inline]
pub(super) fn innovation<const D: usize, const N: usize>(
    covariance: &Covariance<N>,
    model: &Linearised<D, N>,
) -> Result<Innovation<D, N>, Refusal> {
    let projected = covariance.project(&model.jacobian);
    let innovation = covariance.innovation(&model.jacobian, &projected, &model.residual, &model.noise);
    innovation.ok_or(Refusal::Noise)
}

impl<const D: usize, const N: usize> Weighed<D, N> {
    /// Asks the gate of `stream`. If that has run out of patience, the covariance is raised until the measurement fits.
    ///
    /// # Errors
    ///
    /// [`Refusal::Gate`] and [`Refusal::Noise`]; the covariance is then as it was.
    #[inline]
    pub(super) fn new(
        covariance: &mut Covariance<N>,
        stream: &Stream,
        model: &Linearised<D, N>,
        gate: Gate,
    ) -> Result<Self, Refusal> {
        let plain = innovation(covariance, model)?;
        let nis = plain.nis();
        let verdict = stream.weigh(nis, D, plain.log_density(), gate)?;
        let mut weighed = Self { innovation: plain, nis, verdict, before: None };
        if verdict.weight < 1.0 || verdict.raised > 1.0 {
            let mut softened = *model;
            softened.noise /= verdict.weight;
            weighed.before = Some(*covariance);
            covariance.raise(verdict.raised);
            match innovation(covariance, &softened) {
                Ok(softened) => weighed.innovation = softened,
                Err(error) => {
                    weighed.undo(covariance);
                    return Err(error);
                }
            }
        }
        Ok(weighed)
    }

    /// Takes back what was done to the covariance.
    pub(super) fn undo(&self, covariance: &mut Covariance<N>) {
        if let Some(before) = self.before {
            *covariance = before;
        }
    }

    /// What the update did.
    #[inline]
    pub(super) fn fused(&self) -> Fused {
        let Verdict { weight, raised, limit, log_likelihood } = self.verdict;
        let whitened = self.innovation.whitened.first().copied().unwrap_or(0.0);
        Fused { nis: self.nis, dimension: D, weight, raised, limit, log_likelihood, whitened }
    }
}
