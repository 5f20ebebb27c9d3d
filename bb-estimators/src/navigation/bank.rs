//! Several filters that differ by their parameters, weighed by how well each expected what was measured.
//!
//! A static multiple-model estimator: D. T. Magill, "Optimal adaptive estimation of sampled stochastic processes", IEEE
//! Transactions on Automatic Control 10(4), 1965; Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications
//! to Tracking and Navigation", 2001, section 11.6.2. It answers what nobody knows of a robot beforehand: whether the noise
//! on the IMU's data sheet is all that there is on this vehicle, or whether the scale of a visual odometry drifts. Filters
//! that have become implausible are dropped, so that in the long run it costs about as much as one.

use nalgebra::{SMatrix, SVector};

use super::eskf::{Eskf, ImuMean, Start};
use super::fused::Fused;
use super::math::{exp, ln};
use super::measurement::Measurement;
use super::refusal::Refusal;
use super::state::{Estimate, States};
use super::stream::Stream;

/// A filter whose log likelihood is this far below that of the best is dropped: odds of 1 to 10¹¹.
const IMPLAUSIBLE: f64 = 25.0;

/// Up to `M` filters of one type.
///
/// Each sensor has `M` [`Stream`]s, one a filter: they may differ, too, in
/// [`variance_factor`](super::StreamParams::variance_factor) above all.
#[derive(Clone, Debug, PartialEq)]
pub struct Bank<S: States, const N: usize, const M: usize> {
    filters: [Eskf<S, N>; M],
    /// Logarithm of the weights, the largest 0.
    log_weights: [f64; M],
    alive: [bool; M],
}

impl<S: States, const N: usize, const M: usize> Bank<S, N, M> {
    /// A bank of filters, each with how plausible it is beforehand: positive, of any sum.
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
    /// As one of them.
    pub fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.filters.iter_mut().try_for_each(|filter| filter.start(start))
    }

    /// Moves all filters over one sample of the IMU; see [`Eskf::propagate`].
    ///
    /// # Errors
    ///
    /// As one of them: they agree about samples.
    pub fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        let mut alive = self.filters.iter_mut().zip(&self.alive).filter(|(_, alive)| **alive);
        alive.try_for_each(|(filter, _)| filter.propagate(sample))
    }

    /// Corrects all filters by a measurement, and weighs them by it; see [`Eskf::update`].
    ///
    /// The gate is that of all together: what one filter accepts, all fuse, and it counts against those that did not
    /// expect it. What none accepts says nothing about which is right.
    ///
    /// # Errors
    ///
    /// As the most plausible filter. Others may have taken it.
    pub fn update<X: Measurement<D>, const D: usize>(
        &mut self,
        streams: &mut [Stream; M],
        measurement: &X,
    ) -> Result<Fused, Refusal> {
        let best = self.best();
        let mut answer = Err(Refusal::NotStarted);
        let is_plausible = (0..M).any(|i| self.alive[i] && self.filters[i].accepts(&streams[i], measurement));
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

    /// The mean of the filters and its covariance, `N × N`, which holds how much they differ. None before the start.
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

    /// How plausible each filter is; the sum is 1, and filters that were dropped have 0.
    pub fn weights(&self) -> [f64; M] {
        let mut weights = [0.0; M];
        for i in (0..M).filter(|i| self.alive[*i]) {
            weights[i] = exp(self.log_weights[i]);
        }
        let sum: f64 = weights.iter().sum();
        weights.map(|weight| weight / sum)
    }

    /// The place of the most plausible filter.
    pub fn best(&self) -> usize {
        let alive = (0..M).filter(|i| self.alive[*i]);
        alive.max_by(|a, b| self.log_weights[*a].total_cmp(&self.log_weights[*b])).unwrap_or(0)
    }

    /// The filters, those that were dropped included, as they were then.
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

#[cfg(test)]
mod tests;
