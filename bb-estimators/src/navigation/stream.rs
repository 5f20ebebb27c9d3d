//! Per-sensor state of a filter: gate, weighting, and consistency statistics.

use crate::navigation::chi_square::limit;
use crate::navigation::consistency::Consistency;
use crate::navigation::fused::{Fused, Judged};
use crate::navigation::math::sqrt;
use crate::navigation::refusal::Refusal;
use crate::params::params;

/// The largest measurement dimension whose gate thresholds are cached.
const DIMENSIONS: usize = 7;

params! {
    /// Parameters by which the measurements of one sensor are judged.
    pub struct StreamParams {
        /// Factor on the variance of every measurement.
        variance_factor: f64 = 1.0, in 1e-12..=1e12;
        /// Fraction of valid measurements that the gate rejects; 0 disables the gate.
        ///
        /// Small: lets more outliers pass. Large: rejects measurements that would correct a wrong estimate.
        gate: f64 = 1e-4, in 0.0..=1.0;
        /// Fraction of valid measurements whose weight is reduced like that of outliers, by Huber's function of their
        /// Mahalanobis distance. 0: none.
        ///
        /// Small: the weights of a least-squares filter. Large: closer to a median.
        robust: f64 = 0.0, in 0.0..=1.0;
    }
}

/// Counts of a sensor's measurements, fused and rejected by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Fused with their full weight.
    pub fused: u64,
    /// Fused with reduced weight.
    pub weighed_down: u64,
    /// [`Refusal::Gate`].
    pub gate: u64,
    /// [`Refusal::NonFinite`], [`Refusal::OutOfRange`] and [`Refusal::Noise`].
    pub invalid: u64,
    /// [`Refusal::NoKeyframe`], [`Refusal::NotAdjacent`], [`Refusal::Full`], [`Refusal::Repeated`], [`Refusal::NotObservable`] and
    /// [`Refusal::NotStarted`].
    pub not_applicable: u64,
    /// [`Refusal::TooOld`], [`Refusal::TimeNotIncreasing`] and [`Refusal::Gap`].
    pub late: u64,
    /// [`Refusal::InTheFuture`].
    pub future: u64,
    /// Rejected by the gate since the last fused measurement.
    pub gate_in_a_row: u64,
}

/// Application of the gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gate {
    /// Measurements that are too far off are rejected.
    Closed,
    /// All measurements pass.
    Open,
}

/// The state that a filter keeps for one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stream {
    params: StreamParams,
    gates: [f64; DIMENSIONS],
    huber: [f64; DIMENSIONS],
    counts: Counts,
    consistency: Consistency,
}

impl Default for Stream {
    fn default() -> Self {
        Self::new(StreamParams::default())
    }
}

impl Stream {
    /// Creates the stream of a sensor without measurements.
    pub fn new(params: StreamParams) -> Self {
        Self {
            params,
            gates: core::array::from_fn(|dimension| limit(dimension, params.gate)),
            huber: core::array::from_fn(|dimension| limit(dimension, params.robust)),
            counts: Counts::default(),
            consistency: Consistency::default(),
        }
    }

    /// The parameters of the stream.
    pub fn params(&self) -> &StreamParams {
        &self.params
    }

    /// Counts of its measurements, by outcome.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Consistency of the measurements that the gate accepted.
    pub fn consistency(&self) -> &Consistency {
        &self.consistency
    }

    /// Resets the count of successive rejections, because the filter was relocated.
    pub(crate) fn forgive(&mut self) {
        self.counts.gate_in_a_row = 0;
    }

    /// The largest normalised innovation squared that the gate accepts.
    #[inline]
    pub(super) fn gate(&self, dimension: usize) -> f64 {
        self.gates.get(dimension).copied().unwrap_or_else(|| limit(dimension, self.params.gate))
    }

    /// Decides how a measurement is fused, or rejects it.
    #[inline(always)]
    pub(super) fn weigh(&self, judged: &Judged, dimension: usize, gate: Gate) -> Result<Fused, Refusal> {
        let Judged { nis, log_density, whitened } = *judged;
        let log_likelihood = log_density - 0.5 * nis;
        let most = self.gate(dimension);
        if nis > most && matches!(gate, Gate::Closed) {
            return Err(Refusal::Gate { nis, limit: most });
        }
        let huber = self.huber.get(dimension).copied().unwrap_or_else(|| limit(dimension, self.params.robust));
        let weight = if nis > huber { sqrt(huber / nis) } else { 1.0 };
        Ok(Fused { nis, dimension, weight, limit: most, log_likelihood, whitened })
    }

    #[inline]
    pub(crate) fn count(&mut self, result: &Result<Fused, Refusal>) {
        match result {
            Ok(fused) => {
                if fused.weight < 1.0 {
                    self.counts.weighed_down += 1;
                } else {
                    self.counts.fused += 1;
                }
                self.counts.gate_in_a_row = 0;
                self.consistency.add(fused);
            }
            Err(Refusal::Gate { .. }) => {
                self.counts.gate += 1;
                self.counts.gate_in_a_row += 1;
            }
            Err(Refusal::NonFinite | Refusal::OutOfRange | Refusal::Noise) => self.counts.invalid += 1,
            Err(
                Refusal::NoKeyframe { .. }
                | Refusal::NotAdjacent { .. }
                | Refusal::Full { .. }
                | Refusal::Repeated { .. }
                | Refusal::NotObservable
                | Refusal::NotStarted,
            ) => {
                self.counts.not_applicable += 1;
            }
            Err(Refusal::TooOld { .. } | Refusal::TimeNotIncreasing { .. } | Refusal::Gap { .. }) => {
                self.counts.late += 1;
            }
            Err(Refusal::InTheFuture { .. }) => self.counts.future += 1,
        }
    }
}
