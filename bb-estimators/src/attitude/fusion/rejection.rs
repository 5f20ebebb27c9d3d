//! Rejection of a sensor's samples, and recovery from it, according to the library's documentation.

use crate::attitude::Real;

/// An accepted sample counts this many times as much against recovery as a rejected one counts for it: recovery
/// starts above 90 % of rejected samples.
const ACCEPTED_WEIGHT: f64 = 9.0;

/// Rejection of one sensor.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rejection<T> {
    /// Time counted towards recovery, from 0 to the recovery time, s.
    trigger_s: T,
    recovering: bool,
    ignored: bool,
}

impl<T: Real> Rejection<T> {
    pub(super) fn new() -> Self {
        Self { trigger_s: T::ZERO, recovering: false, ignored: false }
    }

    /// Returns whether the last sample was ignored.
    pub(super) fn is_ignored(&self) -> bool {
        self.ignored
    }

    /// Returns whether to accept a sample that is, or is not, `near` the expected value.
    #[inline]
    pub(super) fn takes(&mut self, dt_s: T, recovery_time_s: T, near: bool) -> bool {
        self.trigger_s += if near { -T::of(ACCEPTED_WEIGHT) * dt_s } else { dt_s };
        if self.trigger_s > recovery_time_s {
            self.recovering = true;
        } else if self.trigger_s <= T::ZERO {
            self.recovering = false;
        }
        self.trigger_s = self.trigger_s.clamp(T::ZERO, recovery_time_s);
        self.ignored = !near && !self.recovering;
        !self.ignored
    }
}
