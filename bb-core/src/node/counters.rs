//! Counters of a running estimator.

use super::count::Count;
use super::latency::{Latency, LatencyStatistics};
use crate::declaration::EstimatorDeclaration;
use crate::event::{HealthState, HealthTransition};
use crate::fault::lock;
use crate::joints::LookupError;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Reason for which a message or a dispatch was dropped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum DropReason {
    /// The driving input arrived, but this input had not yet arrived or was too old.
    SyncMiss,
    /// The message was older than the last one of its input.
    OutOfOrder,
    /// The message held a NaN or an infinity.
    NonFinite,
    /// The message's stamp was more than a second ahead of the clock.
    ClockSkew,
    /// The estimator is not running: it has stopped, or it is waiting for its restart and its backlog is full.
    Stopped,
    /// The estimator was busy and its inbox full.
    Overflow,
    /// The driving input arrived, but the state of a joint between this input and the output was unknown or too old.
    NoTransform,
    /// The message waited for the driving input, and newer ones took its place. Only an input of the type [`Every`](crate::Every) keeps
    /// several.
    Displaced,
}

/// Number of callbacks of which one is measured without a declared budget or a handler of telemetry: a power of two.
pub(super) const SAMPLED: u64 = 64;

const REASONS: usize = DropReason::ALL.len();

impl DropReason {
    /// All reasons.
    pub const ALL: &'static [Self] = &[
        Self::SyncMiss,
        Self::OutOfOrder,
        Self::NonFinite,
        Self::ClockSkew,
        Self::Stopped,
        Self::Overflow,
        Self::NoTransform,
        Self::Displaced,
    ];

    /// Returns the name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SyncMiss => "sync miss",
            Self::OutOfOrder => "out of order",
            Self::NonFinite => "non-finite",
            Self::ClockSkew => "clock skew",
            Self::Stopped => "stopped",
            Self::Overflow => "inbox full",
            Self::NoTransform => "no transform",
            Self::Displaced => "displaced",
        }
    }
}

#[derive(Debug, Default)]
pub(super) struct InputCounters {
    pub(super) received: Count,
    pub(super) dropped: [Count; REASONS],
    /// Messages that did not fit in the inbox. Their publishers count them, while another thread may hold the estimator. They are
    /// not included in the other two counters.
    overflowed: AtomicU64,
    /// The age of the driving input's messages, in nanoseconds, when the callback they led to returned.
    pub(super) age: Option<Latency>,
}

#[derive(Debug, Default)]
pub(crate) struct Counters {
    pub(super) inputs: Box<[InputCounters]>,
    pub(super) dispatched: Count,
    pub(crate) emitted: Count,
    pub(super) diverged: Count,
    pub(super) restarts: Count,
    pub(super) transitions: Count,
    /// Durations of callbacks, in nanoseconds: all callbacks where a latency budget is declared or a telemetry handler listens, else
    /// every 64th run.
    pub(super) latency: Latency,
    pub(super) last_divergence: Mutex<Option<&'static str>>,
    /// Last drop, see [`Self::set_last_drop`]; 0 if nothing was dropped.
    last_drop: AtomicU64,
}

impl Counters {
    pub(super) fn new(declaration: &EstimatorDeclaration) -> Self {
        let inputs = declaration
            .inputs
            .iter()
            .map(|input| InputCounters { age: input.driver.then(Latency::default), ..InputCounters::default() });
        let inputs = inputs.collect();
        Self { inputs, ..Self::default() }
    }

    pub(super) fn drop(&self, input: usize, reason: DropReason) {
        if let Some(counters) = self.inputs.get(input) {
            counters.dropped[reason as usize].increment();
            self.set_last_drop(input, reason);
        }
    }

    /// Stores a drop with the number of preceding runs: runs, input and reason in one word, from the upper half.
    fn set_last_drop(&self, input: usize, reason: DropReason) {
        let runs = self.dispatched.get() << 32;
        let drop = (input as u64) << 8 | (reason as u64 + 1);
        self.last_drop.store(runs | drop & u64::from(u32::MAX), Ordering::Relaxed);
    }

    /// The input and the reason of the last drop, unless the estimator has run since.
    pub(super) fn last_drop(&self, declaration: &EstimatorDeclaration) -> Option<(&'static str, DropReason)> {
        let drop = self.last_drop.load(Ordering::Relaxed);
        if drop >> 32 != self.dispatched.get() & u64::from(u32::MAX) {
            return None;
        }
        let reason = DropReason::ALL.get((drop as u8 as usize).checked_sub(1)?)?;
        let input = declaration.inputs.get((drop as u32 >> 8) as usize)?;
        Some((input.name, *reason))
    }

    /// Counts a message that did not fit in an inbox; called on any thread.
    pub(super) fn overflow(&self, input: usize) {
        if let Some(counters) = self.inputs.get(input) {
            counters.overflowed.fetch_add(1, Ordering::Relaxed);
            self.set_last_drop(input, DropReason::Overflow);
        }
    }

    pub(super) fn diverge(&self, reason: &'static str) {
        self.diverged.increment();
        *lock(&self.last_divergence) = Some(reason);
    }

    pub(super) fn statistics(
        &self,
        declaration: &EstimatorDeclaration,
        health: Option<HealthState>,
        last_transition: Option<HealthTransition>,
        stopped: Option<String>,
        last_gap: Option<LookupError>,
    ) -> EstimatorStatistics {
        let inputs = declaration.inputs.iter().zip(&self.inputs).map(|(declared, counters)| {
            let overflowed = counters.overflowed.load(Ordering::Relaxed);
            let mut dropped = counters.dropped.each_ref().map(Count::get);
            dropped[DropReason::Overflow as usize] = overflowed;
            let received = counters.received.get() + overflowed;
            let age = counters.age.as_ref().map(Latency::statistics).unwrap_or_default();
            InputStatistics { name: declared.name, source: declared.source, received, dropped, age }
        });
        EstimatorStatistics {
            path: declaration.path,
            inputs: inputs.collect(),
            dispatched: self.dispatched.get(),
            emitted: self.emitted.get(),
            diverged: self.diverged.get(),
            restarts: self.restarts.get(),
            transitions: self.transitions.get(),
            health,
            last_transition,
            latency: self.latency.statistics(),
            last_divergence: *lock(&self.last_divergence),
            last_drop: self.last_drop(declaration),
            stopped,
            last_gap,
        }
    }
}

/// The counts of an estimator since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct EstimatorStatistics {
    /// Path of the estimator.
    pub path: &'static str,
    /// Counts by input, in the order of declaration.
    pub inputs: Vec<InputStatistics>,
    /// Number of calls.
    pub dispatched: u64,
    /// Number of emissions.
    pub emitted: u64,
    /// Number of times that the estimator reported that it has diverged.
    pub diverged: u64,
    /// Number of restarts.
    pub restarts: u64,
    /// Number of changes of health.
    pub transitions: u64,
    /// Health; `None` if it was left out by [`Fault::skip`](crate::Fault::skip), for the reason in `stopped`.
    pub health: Option<HealthState>,
    /// The last change of its health: since when it has been in this state, and why.
    pub last_transition: Option<HealthTransition>,
    /// Durations of its callbacks: all callbacks where a `latency_budget` is declared or a handler of telemetry listens, else every
    /// 64th run.
    pub latency: LatencyStatistics,
    /// The reason of its last divergence.
    pub last_divergence: Option<&'static str>,
    /// The input and the reason of the last dropped message or run, if the estimator has not run since. It explains why an
    /// estimator is lost although its driving input arrives.
    pub last_drop: Option<(&'static str, DropReason)>,
    /// Reason for which the estimator is not running, if so.
    pub stopped: Option<String>,
    /// Reason for which the last dispatch that lacked a transform was dropped: the joint concerned, and the age of its state.
    pub last_gap: Option<LookupError>,
}

/// The counts of an input since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct InputStatistics {
    /// Name of the input.
    pub name: &'static str,
    /// The path of its publisher.
    pub source: &'static str,
    /// Messages that arrived, including dropped ones.
    pub received: u64,
    /// The age of the driving input's messages, from their stamp to the return of the callback they led to. It is measured in the same way
    /// as [`EstimatorStatistics::latency`].
    pub age: LatencyStatistics,
    dropped: [u64; REASONS],
}

impl InputStatistics {
    /// Returns the number of messages that were dropped for `reason`.
    pub fn dropped(&self, reason: DropReason) -> u64 {
        self.dropped[reason as usize]
    }
}
