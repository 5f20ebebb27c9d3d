//! The health of an estimator, with hysteresis on the way back.
//!
//! | in | event | becomes | reason | command |
//! |---|---|---|---|---|
//! | healthy | a bad completion, a dispatch dropped for sync, a restart | degraded | what was bad | `on_degraded` |
//! | degraded | `recover_after` consecutive good completions | healthy | recovered | `on_recovered` |
//! | degraded | anything bad | degraded, count back to 0 | – | – |
//! | healthy, degraded | no run completed on a message of the driving input for `lost_after` | lost | lost | `on_lost` |
//! | lost | first run completed on a message of the driving input | degraded, that completion counts if good | recovered | none |
//!
//! The watchdog, which waits for no user code, decides whether an estimator is lost. It notifies the estimator by an entry of its
//! island. A run completed before the estimator takes that entry counts as the first one after the loss.

use crate::event::{HealthReason, HealthState};

/// An event that concerns an estimator's health.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// A run in budget, synchronous and not diverged.
    Good,
    /// Any event that degrades the estimator.
    Bad(HealthReason),
    /// No run was completed on a message of the driving input for `lost_after`.
    Silence,
    /// A run was completed on a message of the driving input.
    Run,
}

/// The state and the number of consecutive good completions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Health {
    pub(super) state: HealthState,
    good: u32,
}

impl Health {
    /// Takes an event; returns the new state and the reason if the state changes.
    pub(super) fn on(&mut self, event: Event, recover_after: u32) -> Option<(HealthState, HealthReason)> {
        use HealthState::{Degraded, Healthy, Lost};
        let (state, reason) = match (self.state, event) {
            (Healthy, Event::Bad(reason)) => (Degraded, reason),
            (Healthy | Degraded, Event::Silence) => (Lost, HealthReason::Lost),
            (Lost, Event::Run) => (Degraded, HealthReason::Recovered),
            (Degraded, Event::Good) => {
                self.good += 1;
                if self.good < recover_after {
                    return None;
                }
                (Healthy, HealthReason::Recovered)
            }
            (Degraded, Event::Bad(_)) => {
                self.good = 0;
                return None;
            }
            (Healthy, Event::Good | Event::Run)
            | (Degraded, Event::Run)
            | (Lost, Event::Good | Event::Bad(_) | Event::Silence) => return None,
        };
        *self = Self { state, good: 0 };
        Some((state, reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use HealthState::{Degraded, Healthy, Lost};

    /// Every state with every event: the next state and the reason.
    #[test]
    fn every_row_of_the_table() {
        let bad = Event::Bad(HealthReason::SyncMiss);
        let rows = [
            (Healthy, Event::Good, None),
            (Healthy, Event::Run, None),
            (Healthy, bad, Some((Degraded, HealthReason::SyncMiss))),
            (Healthy, Event::Silence, Some((Lost, HealthReason::Lost))),
            (Degraded, Event::Good, Some((Healthy, HealthReason::Recovered))),
            (Degraded, Event::Run, None),
            (Degraded, bad, None),
            (Degraded, Event::Silence, Some((Lost, HealthReason::Lost))),
            (Lost, Event::Good, None),
            (Lost, Event::Run, Some((Degraded, HealthReason::Recovered))),
            (Lost, bad, None),
            (Lost, Event::Silence, None),
        ];
        for (state, event, expected) in rows {
            assert_eq!(Health { state, good: 0 }.on(event, 1), expected, "{state} on {event:?}");
        }
    }

    #[test]
    fn a_bad_completion_sets_the_count_back() {
        let mut health = Health { state: Degraded, good: 0 };
        let bad = Event::Bad(HealthReason::Diverged);
        for event in [Event::Good, Event::Good, bad, Event::Good, Event::Good] {
            assert_eq!(health.on(event, 3), None);
        }
        assert_eq!(health.on(Event::Good, 3), Some((Healthy, HealthReason::Recovered)));
    }
}
