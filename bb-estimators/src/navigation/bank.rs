//! Several filters with different parameters, weighted by how well each predicts the measurements.
//!
//! A static multiple-model estimator: D. T. Magill, "Optimal adaptive estimation of sampled stochastic processes", IEEE
//! Transactions on Automatic Control 10(4), 1965; Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to
//! Tracking and Navigation", 2001, section 11.6.2. It resolves unknowns about a robot, such as whether the IMU's data sheet
//! covers all the noise on this vehicle, or whether the scale of a visual odometry drifts. Implausible filters are dropped, so in
//! the long run a bank costs about as much as one filter.

use nalgebra::{SMatrix, SVector};

use super::eskf::{Eskf, ImuMean, Start};
use super::fused::Fused;
use super::math::{exp, ln};
use super::measurement::Measurement;
use super::propagate::Propagate;
use super::refusal::Refusal;
use super::state::{Estimate, States};
use super::stream::Stream;

/// A filter is dropped if its log likelihood is this far below that of the best filter: odds of 1 to 10¹¹.
const IMPLAUSIBLE: f64 = 25.0;

/// Up to `M` filters of one type.
///
/// Each sensor has `M` [`Stream`]s, one per filter. Streams may differ too, above all in
/// [`variance_factor`](super::StreamParams::variance_factor).
#[derive(Clone, Debug, PartialEq)]
pub struct Bank<S: States, const N: usize, const M: usize> {
    filters: [Eskf<S, N>; M],
    /// Logarithms of the weights; the largest is 0.
    log_weights: [f64; M],
    alive: [bool; M],
}

impl<S: States, const N: usize, const M: usize> Bank<S, N, M> {
    /// Creates a bank of filters with prior weights, which are positive and need not sum to 1.
    pub fn new(filters: [(Eskf<S, N>, f64); M]) -> Self {
        let log_weights = filters.map(|(_, prior)| ln(prior.max(f64::MIN_POSITIVE)));
        let mut bank = Self { filters: filters.map(|(filter, _)| filter), log_weights, alive: [true; M] };
        bank.normalise();
        bank
    }

    /// Starts all filters; see [`Eskf::start`].
    ///
    /// # Errors
    ///
    /// Returns the error of any filter that fails.
    pub fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.filters.iter_mut().try_for_each(|filter| filter.start(start))
    }

    /// Propagates all filters over one IMU sample; see [`Eskf::propagate`].
    ///
    /// # Errors
    ///
    /// The same as [`Eskf::propagate`]; all filters agree on whether a sample is valid.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.propagate_part(sample, false)
    }

    /// Updates all filters with a measurement and reweights them by its likelihood; see [`Eskf::update`].
    ///
    /// The filters share a gate: if one filter accepts a measurement, all fuse it, and it counts against the filters that did not
    /// expect it. A measurement that every filter rejects does not change the weights, and neither does one that overrides every gate.
    ///
    /// # Errors
    ///
    /// Returns the error of the most plausible filter. Other filters may have fused the measurement.
    pub fn update<X: Measurement<D>, const D: usize>(
        &mut self,
        streams: &mut [Stream; M],
        measurement: &X,
    ) -> Result<Fused, Refusal> {
        let best = self.best();
        let mut answer = Err(Refusal::NotStarted);
        let is_plausible = (0..M).any(|i| self.alive[i] && self.filters[i].fits(&streams[i], measurement));
        for i in (0..M).filter(|i| self.alive[*i]) {
            let (filter, stream) = (&mut self.filters[i], &mut streams[i]);
            let result = if is_plausible {
                filter.update_ungated(stream, measurement)
            } else {
                filter.update(stream, measurement)
            };
            if let (true, Ok(fused)) = (is_plausible, &result) {
                self.log_weights[i] += fused.log_likelihood;
            }
            if i == best {
                answer = result;
            }
        }
        self.normalise();
        answer
    }

    /// Sets a keyframe in all filters; see [`Eskf::set_keyframe`].
    pub fn set_keyframe(&mut self, id: u64) {
        let alive = self.filters.iter_mut().zip(&self.alive).filter(|(_, alive)| **alive);
        alive.for_each(|(filter, _)| filter.set_keyframe(id));
    }

    /// The mean of the filters and its covariance, `N × N`, which includes the spread between them. `None` before the start.
    pub fn estimate(&self) -> Option<(Estimate<N>, SMatrix<f64, N, N>)> {
        let reference = *self.filters.get(self.best())?.estimate()?;
        let weights = self.weights();
        let mut errors = [SVector::<f64, N>::zeros(); M];
        let mut mean = SVector::<f64, N>::zeros();
        for i in (0..M).filter(|i| weights[*i] > 0.0) {
            errors[i] = reference.error_to::<S>(self.filters[i].estimate()?);
            mean += errors[i] * weights[i];
        }
        let mut covariance = SMatrix::<f64, N, N>::zeros();
        for i in (0..M).filter(|i| weights[*i] > 0.0) {
            let apart = errors[i] - mean;
            covariance += (self.filters[i].covariance() + apart * apart.transpose()) * weights[i];
        }
        Some((reference.corrected::<S>(&mean), covariance))
    }

    /// The weight of each filter; the weights sum to 1, and dropped filters have 0.
    pub fn weights(&self) -> [f64; M] {
        let mut weights = [0.0; M];
        for i in (0..M).filter(|i| self.alive[*i]) {
            weights[i] = exp(self.log_weights[i]);
        }
        let sum: f64 = weights.iter().sum();
        weights.map(|weight| weight / sum)
    }

    /// The index of the most plausible filter.
    pub fn best(&self) -> usize {
        let alive = (0..M).filter(|i| self.alive[*i]);
        alive.max_by(|a, b| self.log_weights[*a].total_cmp(&self.log_weights[*b])).unwrap_or(0)
    }

    /// The filters, including dropped ones in their state when they were dropped.
    pub fn filters(&self) -> &[Eskf<S, N>; M] {
        &self.filters
    }

    fn normalise(&mut self) {
        let most = self.log_weights.get(self.best()).copied().unwrap_or(0.0);
        for (weight, alive) in self.log_weights.iter_mut().zip(&mut self.alive) {
            *weight -= most;
            *alive &= *weight > -IMPLAUSIBLE;
        }
    }
}

impl<S: States, const N: usize, const M: usize> Propagate for Bank<S, N, M> {
    fn time_ns(&self) -> Option<i64> {
        Some(self.filters.get(self.best())?.estimate()?.time_ns)
    }

    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.propagate(sample)
    }

    /// The shortest [`longest_sample`](super::EskfParams::longest_sample) of all filters, s.
    fn longest_sample(&self) -> f64 {
        self.filters.iter().map(|filter| filter.params().longest_sample).fold(f64::INFINITY, f64::min)
    }

    fn propagate_part(&mut self, part: &ImuMean, is_gap: bool) -> Result<(), Refusal> {
        let mut alive = self.filters.iter_mut().zip(&self.alive).filter(|(_, alive)| **alive);
        alive.try_for_each(|(filter, _)| filter.propagate_part(part, is_gap))
    }
}

#[cfg(test)]
mod tests;
