//! What a filter keeps of each sensor: its gate, how it is weighed, and how consistent it was.

use crate::navigation::chi_square::limit;
use crate::navigation::consistency::Consistency;
use crate::navigation::eskf::Refusal;
use crate::navigation::math::{ln, sqrt};

/// The largest dimension of a measurement whose limits are kept.
const DIMENSIONS: usize = 7;

/// How the measurements of one sensor are judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamParams {
    /// What the variance of every measurement is multiplied by. Default: 1.
    pub variance_factor: f64,
    /// Part of good measurements that the gate refuses; 0 for no gate.
    ///
    /// Small: lets more outliers pass. Large: refuses what a filter that is off needs. Default: 1e-4.
    pub gate: f64,
    /// Part of good measurements that are weighed down as outliers are, by Huber's function of their Mahalanobis distance; 0
    /// for none.
    ///
    /// Small: the weights of a least-squares filter. Large: closer to a median. Default: 0.
    pub robust: f64,
    /// How fast the noise of the sensor adapts to its innovations: the change of its variance, per measurement; 0 for
    /// never.
    ///
    /// Small: the noise is as given. Large: follows each innovation. Default: 0.
    pub adaptation: f64,
    /// The most that the adapted variance is of the given one; at least 1. Default: 100.
    pub most_adaptation: f64,
}

impl Default for StreamParams {
    fn default() -> Self {
        Self { variance_factor: 1.0, gate: 1e-4, robust: 0.0, adaptation: 0.0, most_adaptation: 100.0 }
    }
}

/// How often a sensor's measurements were taken, and how often refused for which reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Fused with their full weight.
    pub fused: u64,
    /// Fused with less.
    pub weighed_down: u64,
    /// [`Refusal::Gate`].
    pub gate: u64,
    /// [`Refusal::NonFinite`], [`Refusal::OutOfRange`] and [`Refusal::Noise`].
    pub invalid: u64,
    /// [`Refusal::NoKeyframe`], [`Refusal::NotObservable`] and [`Refusal::NotStarted`].
    pub not_applicable: u64,
    /// [`Refusal::TooOld`], [`Refusal::TimeNotIncreasing`] and [`Refusal::Gap`].
    pub late: u64,
    /// [`Refusal::InTheFuture`].
    pub future: u64,
    /// Refused by the gate since the last one that was fused.
    pub gate_in_a_row: u64,
}

/// What an update did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fused {
    /// Normalised innovation squared: its mean is [`dimension`](Self::dimension) if the filter is consistent.
    pub nis: f64,
    /// The dimension of the measurement.
    pub dimension: usize,
    /// The weight that it had, 1 unless [`StreamParams::robust`] took it down.
    pub weight: f64,
    /// Logarithm of the likelihood of the innovation, but for the constant that depends on the dimension alone: to compare
    /// models. Normal up to the gate; beyond it the tails are those of a multivariate Cauchy distribution, so that no outlier
    /// decides by itself.
    pub log_likelihood: f64,
    /// The first component of the whitened innovation.
    pub(crate) whitened: f64,
}

/// One sensor, as a filter knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stream {
    params: StreamParams,
    gates: [f64; DIMENSIONS],
    huber: [f64; DIMENSIONS],
    noise_factor: f64,
    counts: Counts,
    consistency: Consistency,
}

impl Default for Stream {
    fn default() -> Self {
        Self::new(StreamParams::default())
    }
}

impl Stream {
    /// A sensor without a measurement.
    pub fn new(params: StreamParams) -> Self {
        Self {
            params,
            gates: core::array::from_fn(|dimension| limit(dimension, params.gate)),
            huber: core::array::from_fn(|dimension| limit(dimension, params.robust)),
            noise_factor: 1.0,
            counts: Counts::default(),
            consistency: Consistency::default(),
        }
    }

    /// How it judges.
    pub fn params(&self) -> &StreamParams {
        &self.params
    }

    /// What became of its measurements.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// How consistent those were that the gate let pass.
    pub fn consistency(&self) -> &Consistency {
        &self.consistency
    }

    /// What its variance is multiplied by, from [`StreamParams::variance_factor`] and [`StreamParams::adaptation`].
    pub fn noise_factor(&self) -> f64 {
        self.noise_factor * self.params.variance_factor
    }

    /// The weight of a measurement and its log likelihood, or that it is refused.
    #[inline]
    pub(crate) fn weigh(&self, nis: f64, dimension: usize, log_density: f64) -> Result<(f64, f64), Refusal> {
        let kept = dimension.min(DIMENSIONS - 1);
        let gate = if kept == dimension { self.gates[kept] } else { limit(dimension, self.params.gate) };
        if nis > gate {
            let log_likelihood = log_density - 0.5 * gate - 0.5 * (dimension as f64 + 1.0) * ln(nis / gate);
            return Err(Refusal::Gate { nis, limit: gate, log_likelihood });
        }
        let huber = if kept == dimension { self.huber[kept] } else { limit(dimension, self.params.robust) };
        let weight = if nis > huber { sqrt(huber / nis) } else { 1.0 };
        Ok((weight, log_density - 0.5 * nis))
    }

    #[inline]
    pub(crate) fn count(&mut self, result: &Result<Fused, Refusal>) {
        let adapt = |factor: f64, share: f64| {
            let change = self.params.adaptation * (share - 1.0);
            (factor * (1.0 + change.clamp(-0.5, 1.0))).clamp(1.0, self.params.most_adaptation.max(1.0))
        };
        match result {
            Ok(fused) => {
                if fused.weight < 1.0 {
                    self.counts.weighed_down += 1;
                } else {
                    self.counts.fused += 1;
                }
                self.counts.gate_in_a_row = 0;
                self.noise_factor = adapt(self.noise_factor, fused.nis / fused.dimension as f64);
                self.consistency.add(fused);
            }
            Err(Refusal::Gate { .. }) => {
                self.counts.gate += 1;
                self.counts.gate_in_a_row += 1;
            }
            Err(Refusal::NonFinite | Refusal::OutOfRange | Refusal::Noise) => self.counts.invalid += 1,
            Err(Refusal::NoKeyframe { .. } | Refusal::NotObservable | Refusal::NotStarted) => {
                self.counts.not_applicable += 1;
            }
            Err(Refusal::TooOld { .. } | Refusal::TimeNotIncreasing { .. } | Refusal::Gap { .. }) => {
                self.counts.late += 1;
            }
            Err(Refusal::InTheFuture { .. }) => self.counts.future += 1,
        }
    }
}
