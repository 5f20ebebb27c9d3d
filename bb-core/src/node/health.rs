//! Whether an estimator's output can be relied on: healthy, degraded or lost, with hysteresis on the way back.
//!
//! | in | event | becomes | reason | command |
//! |---|---|---|---|---|
//! | healthy | a bad completion, or a dispatch dropped for sync | degraded | what was bad | `on_degraded` |
//! | degraded | `recover_after` consecutive good completions | healthy | recovered | `on_recovered` |
//! | degraded | anything bad | degraded, count back to 0 | – | – |
//! | healthy, degraded | no input for `lost_after` | lost | lost | `on_lost` |
//! | lost | first input | degraded, that completion counts if good | recovered | none |

use super::HealthDeclaration;
use crate::Payload;
use crate::time::MonotonicTime;
use std::fmt;

/// How far an estimator's output can be relied on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
pub enum HealthState {
    /// Its last completions were good.
    #[default]
    Healthy,
    /// Something was bad, and not enough good completions have followed.
    Degraded,
    /// No input has come for `lost_after`.
    Lost,
}

/// Why the health of an estimator has changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
#[non_exhaustive]
pub enum HealthReason {
    /// A callback took longer than `latency_budget`.
    LatencyOverrun,
    /// A dispatch was dropped: an input was missing or too old.
    SyncMiss,
    /// The driver's message was older than its `within` when it arrived.
    StaleInput,
    /// The algorithm reported that its estimate is not to be trusted.
    Diverged,
    /// It failed and was started anew.
    Restarted,
    /// No input came for `lost_after`.
    Lost,
    /// Input came again, or enough good completions followed.
    Recovered,
}

/// A change of an estimator's health, as published and as commands get it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct HealthTransition {
    /// The path of the estimator.
    pub estimator: &'static str,
    /// The path of the publisher whose message, or whose silence, was the cause.
    pub source: &'static str,
    /// What it was.
    pub from: HealthState,
    /// What it is.
    pub to: HealthState,
    /// Why.
    pub reason: HealthReason,
    /// When.
    pub time: MonotonicTime,
}

/// What happens to an estimator, as far as its health is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// A completion in budget, synchronous and not diverged.
    Good,
    /// Anything that degrades.
    Bad(HealthReason),
    /// No input for `lost_after`.
    Silence,
    /// An input was let in.
    Input,
}

/// The state, and how many good completions stand in a row.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Health {
    pub(super) state: HealthState,
    good: u32,
}

impl Health {
    /// Takes an event; the new state and the reason, if it changes.
    pub(super) fn on(&mut self, event: Event, recover_after: u32) -> Option<(HealthState, HealthReason)> {
        use HealthState::{Degraded, Healthy, Lost};
        let (state, reason) = match (self.state, event) {
            (Healthy, Event::Bad(reason)) => (Degraded, reason),
            (Healthy | Degraded, Event::Silence) => (Lost, HealthReason::Lost),
            (Lost, Event::Input) => (Degraded, HealthReason::Recovered),
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
            (Healthy, Event::Good | Event::Input)
            | (Degraded, Event::Input)
            | (Lost, Event::Good | Event::Bad(_) | Event::Silence) => return None,
        };
        *self = Self { state, good: 0 };
        Some((state, reason))
    }
}

impl HealthDeclaration {
    /// The number of the command that a transition starts, if one is declared. `Lost` to `Degraded` starts none.
    pub(crate) fn command(&self, from: HealthState, to: HealthState) -> Option<usize> {
        match (from, to) {
            (HealthState::Healthy, HealthState::Degraded) => self.on_degraded,
            (_, HealthState::Lost) => self.on_lost,
            (HealthState::Degraded, HealthState::Healthy) => self.on_recovered,
            _ => None,
        }
    }
}

impl HealthState {
    pub(crate) fn from_index(index: u8) -> Self {
        match index {
            0 => Self::Healthy,
            1 => Self::Degraded,
            _ => Self::Lost,
        }
    }
}

impl fmt::Display for HealthState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Healthy => "healthy",
            Self::Degraded => "degraded",
            Self::Lost => "lost",
        })
    }
}

impl fmt::Display for HealthReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LatencyOverrun => "latency overrun",
            Self::SyncMiss => "sync miss",
            Self::StaleInput => "stale input",
            Self::Diverged => "diverged",
            Self::Restarted => "restarted",
            Self::Lost => "lost",
            Self::Recovered => "recovered",
        })
    }
}

impl fmt::Display for HealthTransition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { estimator, source, from, to, reason, time } = self;
        write!(f, "{time}: {estimator} {from} -> {to} ({reason}; {source})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use HealthState::{Degraded, Healthy, Lost};

    /// Every state with every event: what it becomes, and why.
    #[test]
    fn every_row_of_the_table() {
        let bad = Event::Bad(HealthReason::SyncMiss);
        let rows = [
            (Healthy, Event::Good, None),
            (Healthy, Event::Input, None),
            (Healthy, bad, Some((Degraded, HealthReason::SyncMiss))),
            (Healthy, Event::Silence, Some((Lost, HealthReason::Lost))),
            (Degraded, Event::Good, Some((Healthy, HealthReason::Recovered))),
            (Degraded, Event::Input, None),
            (Degraded, bad, None),
            (Degraded, Event::Silence, Some((Lost, HealthReason::Lost))),
            (Lost, Event::Good, None),
            (Lost, Event::Input, Some((Degraded, HealthReason::Recovered))),
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

    #[test]
    fn only_the_way_down_and_the_way_home_start_commands() {
        let declaration = HealthDeclaration {
            on_degraded: Some(0),
            on_lost: Some(1),
            on_recovered: Some(2),
            ..Default::default()
        };
        let started = |from, to| declaration.command(from, to);
        assert_eq!(started(Healthy, Degraded), Some(0));
        assert_eq!(started(Lost, Degraded), None);
        assert_eq!((started(Healthy, Lost), started(Degraded, Lost)), (Some(1), Some(1)));
        assert_eq!(started(Degraded, Healthy), Some(2));
    }
}
