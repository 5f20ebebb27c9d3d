//! What a `History` needs of a filter to replay it.

use super::eskf::{Eskf, ImuMean};
use super::refusal::Refusal;
use super::state::States;

/// A filter that IMU samples carry forward in time.
pub trait Propagate: Clone {
    /// The current time of the filter; `None` before its start.
    fn time_ns(&self) -> Option<i64>;

    /// Propagates the filter over one IMU sample.
    ///
    /// # Errors
    ///
    /// Returns the reason why the sample is rejected. The filter is then unchanged.
    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal>;

    /// The longest interval, s, that one sample covers; a longer one is a gap. Infinite, as by default, for a filter without gaps.
    fn longest_sample(&self) -> f64 {
        f64::INFINITY
    }

    /// Propagates the filter over a part of a sample that measurements divide. `is_gap` tells whether the whole sample is longer than
    /// [`longest_sample`](Self::longest_sample): every part of a gap is a gap, however short it is.
    ///
    /// By default, the part is propagated like a sample of its own. Provide it together with `longest_sample` if your filter treats
    /// gaps differently, as the filters of this module do.
    ///
    /// # Errors
    ///
    /// The same as [`propagate`](Self::propagate).
    fn propagate_part(&mut self, part: &ImuMean, is_gap: bool) -> Result<(), Refusal> {
        let _ = is_gap;
        self.propagate(part)
    }
}

impl<S: States, const N: usize> Propagate for Eskf<S, N> {
    fn time_ns(&self) -> Option<i64> {
        self.estimate().map(|estimate| estimate.time_ns)
    }

    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        self.propagate(sample)
    }

    fn longest_sample(&self) -> f64 {
        self.params().longest_sample
    }

    fn propagate_part(&mut self, part: &ImuMean, is_gap: bool) -> Result<(), Refusal> {
        self.propagate_part(part, is_gap)
    }
}
