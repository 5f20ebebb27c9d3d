//! Delays of restarts.

use crate::time::MonotonicTime;
use std::time::Duration;

/// Settings of the restarts of failed components.
///
/// A fault (`Err`) restarts its component alone, for as long as the robot runs. So does a panic, which also counts
/// against the budget of the component's supervisor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Supervision {
    /// Number of panics that a supervisor allows within [`Self::within`] before it escalates to its parent, which restarts everything
    /// below. Default: 3.
    pub max_restarts: usize,
    /// Time within which panics count, see [`Self::max_restarts`]. Default: 5 s.
    pub within: Duration,
    /// The delay before the first restart of a component, at least 100 µs; it doubles with each further one in a row.
    /// Default: 10 ms.
    pub first_backoff: Duration,
    /// The longest delay. Default: 1 s.
    pub longest_backoff: Duration,
}

/// The shortest delay. On virtual time, a component that fails repeatedly without it would stop time from advancing.
const SHORTEST: Duration = Duration::from_micros(100);

impl Default for Supervision {
    fn default() -> Self {
        Self {
            max_restarts: 3,
            within: Duration::from_secs(5),
            first_backoff: Duration::from_millis(10),
            longest_backoff: Duration::from_secs(1),
        }
    }
}

impl Supervision {
    /// The delay of restart number `attempt` in a row, from 0.
    fn backoff(&self, attempt: u32) -> Duration {
        let factor = 1_u32.checked_shl(attempt).unwrap_or(u32::MAX);
        self.first_backoff.saturating_mul(factor).min(self.longest_backoff).max(SHORTEST)
    }
}

/// Number of a component's failures in a row, and the time of the last one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Failures {
    count: u32,
    last: MonotonicTime,
}

impl Failures {
    /// Counts a failure; returns when to restart the component.
    pub(super) fn add(&mut self, now: MonotonicTime, supervision: &Supervision) -> MonotonicTime {
        // After this long without a failure, the next one counts as the first.
        if now.duration_since(self.last) > supervision.within {
            self.count = 0;
        }
        let at = now + supervision.backoff(self.count);
        *self = Self { count: self.count.saturating_add(1), last: now };
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backoff_doubles_up_to_its_bound_and_starts_again_after_a_while() {
        let supervision = Supervision::default();
        let mut failures = Failures::default();
        let mut now = MonotonicTime::ZERO;
        let mut waits = Vec::new();
        for _ in 0..9 {
            let at = failures.add(now, &supervision);
            waits.push(at.duration_since(now).as_millis());
            now = at;
        }
        assert_eq!(waits, [10, 20, 40, 80, 160, 320, 640, 1000, 1000]);
        now = now + Duration::from_secs(6);
        assert_eq!(failures.add(now, &supervision).duration_since(now).as_millis(), 10);
        assert_eq!(supervision.backoff(200), Duration::from_secs(1));
        let zero = Supervision { first_backoff: Duration::ZERO, longest_backoff: Duration::ZERO, ..supervision };
        assert_eq!([zero.backoff(0), zero.backoff(9)], [SHORTEST; 2]);
    }
}
