//! Health of estimators, as published.

use crate::message::Payload;
use crate::time::MonotonicTime;
use std::fmt;

/// Health of an estimator: how far its output can be trusted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
pub enum HealthState {
    /// The last completions were good.
    #[default]
    Healthy,
    /// Something was bad, and not enough good completions have followed.
    Degraded,
    /// No run on a driver message was completed for `lost_after`.
    Lost,
}

/// Reason for a change of an estimator's health.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
#[non_exhaustive]
pub enum HealthReason {
    /// A callback took longer than `latency_budget`.
    LatencyOverrun,
    /// A dispatch was dropped: an input was missing or too old.
    SyncMiss,
    /// The driver's message was older than its `within` when it arrived.
    StaleInput,
    /// The algorithm reported that its estimate should not be trusted.
    Diverged,
    /// The estimator failed and is restarted, or was restarted by a supervisor or with new options.
    Restarted,
    /// The estimator failed and remains stopped.
    Stopped,
    /// No run on a driver message was completed for `lost_after`.
    Lost,
    /// A run was completed again, or enough good completions followed.
    Recovered,
    /// A dispatch was dropped: a joint between an input and the output was unknown or too old.
    NoTransform,
}

/// A change of an estimator's health, as published and as passed to commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct HealthTransition {
    /// The path of the estimator.
    pub estimator: &'static str,
    /// The path of the publisher whose message, or lack of messages, was the cause.
    pub source: &'static str,
    /// The previous state.
    pub from: HealthState,
    /// The new state.
    pub to: HealthState,
    /// Reason for the change.
    pub reason: HealthReason,
    /// Time of the change.
    pub time: MonotonicTime,
}

impl HealthState {
    pub(crate) fn from_index(index: u8) -> Option<Self> {
        [Self::Healthy, Self::Degraded, Self::Lost].get(usize::from(index)).copied()
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
            Self::Stopped => "stopped",
            Self::Lost => "lost",
            Self::Recovered => "recovered",
            Self::NoTransform => "no transform",
        })
    }
}

impl fmt::Display for HealthTransition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { estimator, source, from, to, reason, time } = self;
        write!(f, "{time}: {estimator} {from} -> {to} ({reason}; {source})")
    }
}
