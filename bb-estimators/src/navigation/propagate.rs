//! Interface of a filter that a `History` replays.

use super::eskf::{EskfFilter, ImuMean, seconds_between};
use super::refusal::Refusal;
use super::state::States;
use crate::navigation::numbers::LONGEST_GAP_S;

/// A filter that IMU samples carry forward in time.
pub trait Propagate: Clone {
    /// The current time of the filter; `None` before its start.
    fn time_ns(&self) -> Option<i64>;

    /// Propagates the filter over one IMU sample.
    ///
    /// # Errors
    ///
    /// Returns the reason why the sample is rejected. The filter is then unchanged.
    fn propagate(&mut self, sample: &ImuMean) -> Result<(), Refusal> {
        let since_ns = self.time_ns().ok_or(Refusal::NotStarted)?;
        self.propagate_until(sample.time_ns, sample, since_ns)
    }

    /// Checks that a sample can be propagated.
    ///
    /// # Errors
    ///
    /// The same as [`propagate`](Self::propagate).
    fn admits(&self, sample: &ImuMean) -> Result<(), Refusal>;

    /// Propagates the filter over the part of a sample that ends at `time_ns`, where a measurement divides it. The sample began at
    /// `since_ns`, which tells a filter that treats gaps differently whether the whole sample is one: every part of a gap is a gap,
    /// however short it is.
    ///
    /// # Errors
    ///
    /// The same as [`propagate`](Self::propagate).
    fn propagate_until(&mut self, time_ns: i64, sample: &ImuMean, since_ns: i64) -> Result<(), Refusal>;
}

impl<S: States, const N: usize> Propagate for EskfFilter<S, N> {
    fn time_ns(&self) -> Option<i64> {
        self.estimate().map(|estimate| estimate.time_ns)
    }

    fn admits(&self, sample: &ImuMean) -> Result<(), Refusal> {
        sample.check()?;
        let seconds = seconds_between(self.time_ns().ok_or(Refusal::NotStarted)?, sample.time_ns)?;
        if seconds > LONGEST_GAP_S { Err(Refusal::Gap { seconds }) } else { Ok(()) }
    }

    fn propagate_until(&mut self, time_ns: i64, sample: &ImuMean, since_ns: i64) -> Result<(), Refusal> {
        // The sample is a mean, so each part of it is the same.
        self.propagate_part(&ImuMean { time_ns, ..*sample }, seconds_between(since_ns, sample.time_ns)?)
    }
}
