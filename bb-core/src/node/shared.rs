//! The part of a running estimator that other threads may access while it runs.

use super::EstimatorStatistics;
use super::counters::Counters;
use crate::declaration::EstimatorDeclaration;
use crate::event::{HealthState, HealthTransition};
use crate::fault::lock;
use crate::joints::{LookupError, PlacedInput, Placement};
use crate::time::MonotonicTime;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicI64, AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

/// Counters, published health, and why the estimator is not running. Clones share the same state.
#[derive(Clone, Debug)]
pub(crate) struct SharedNode(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    number: usize,
    declaration: &'static EstimatorDeclaration,
    counters: Counters,
    /// The health last published by the control state, or [`LEFT_OUT`].
    health: AtomicU8,
    /// Arrival of the last completed run's message, for the watchdog.
    last_run_nanos: AtomicI64,
    /// The last change of health.
    last_transition: Mutex<Option<HealthTransition>>,
    stopped: Mutex<Option<Stopped>>,
    /// Reason for which a dispatch was last dropped for lack of a transform.
    last_gap: Mutex<Option<LookupError>>,
    /// The number of waiting one-way requests.
    casts: AtomicU32,
    /// The simulated duration of its callbacks on virtual time.
    pretended_latency_nanos: AtomicI64,
    /// The recorded durations of its callbacks, in a replay.
    replayed_latencies: Mutex<VecDeque<i64>>,
    /// The recorded transforms of its inputs, in a replay.
    replayed_placements: Mutex<VecDeque<PlacedInput>>,
}

/// Stands for the health of an estimator that was left out.
const LEFT_OUT: u8 = u8::MAX;

/// Reason for which an estimator is not running.
#[derive(Clone, Debug)]
pub(crate) struct Stopped {
    pub(crate) reason: String,
    /// `true` if the estimator is never restarted.
    pub(crate) for_good: bool,
}

impl SharedNode {
    pub(crate) fn new(number: usize, declaration: &'static EstimatorDeclaration) -> Self {
        Self(Arc::new(Inner {
            number,
            declaration,
            counters: Counters::new(declaration),
            health: AtomicU8::new(0),
            last_run_nanos: AtomicI64::new(0),
            last_transition: Mutex::default(),
            stopped: Mutex::new(None),
            last_gap: Mutex::default(),
            casts: AtomicU32::new(0),
            pretended_latency_nanos: AtomicI64::new(0),
            replayed_latencies: Mutex::default(),
            replayed_placements: Mutex::default(),
        }))
    }

    #[inline]
    pub(crate) fn counters(&self) -> &Counters {
        &self.0.counters
    }

    /// Returns the number among the robot's estimators.
    pub(crate) fn number(&self) -> usize {
        self.0.number
    }

    pub(crate) fn declaration(&self) -> &'static EstimatorDeclaration {
        self.0.declaration
    }

    /// Counts a message that did not fit in an inbox.
    pub(crate) fn overflow(&self, input: usize) {
        self.0.counters.overflow(input);
    }

    pub(crate) fn statistics(&self) -> EstimatorStatistics {
        let stopped = lock(&self.0.stopped).clone().map(|stopped| stopped.reason);
        let last_gap = lock(&self.0.last_gap).clone();
        let last_transition = *lock(&self.0.last_transition);
        self.0.counters.statistics(self.0.declaration, self.health(), last_transition, stopped, last_gap)
    }

    /// Health; `None` if it was left out.
    pub(crate) fn health(&self) -> Option<HealthState> {
        HealthState::from_index(self.0.health.load(Ordering::Relaxed))
    }

    /// Leaves out an estimator that is not part of this robot: it has no health, and is not watched.
    pub(super) fn leave_out(&self) {
        self.0.health.store(LEFT_OUT, Ordering::Relaxed);
    }

    /// Records a change of its health.
    pub(crate) fn note_transition(&self, transition: HealthTransition) {
        self.0.health.store(transition.to as u8, Ordering::Relaxed);
        *lock(&self.0.last_transition) = Some(transition);
        self.0.counters.transitions.increment();
    }

    #[inline]
    pub(crate) fn last_run(&self) -> MonotonicTime {
        MonotonicTime::from_nanos(self.0.last_run_nanos.load(Ordering::Acquire))
    }

    #[inline]
    pub(crate) fn set_last_run(&self, time: MonotonicTime) {
        self.0.last_run_nanos.store(time.as_nanos(), Ordering::Release);
    }

    pub(crate) fn stopped(&self) -> Option<Stopped> {
        lock(&self.0.stopped).clone()
    }

    pub(super) fn set_stopped(&self, stopped: Option<Stopped>) {
        *lock(&self.0.stopped) = stopped;
    }

    pub(super) fn set_last_gap(&self, error: LookupError) {
        *lock(&self.0.last_gap) = Some(error);
    }

    /// Reserves one of `most` slots for one-way requests; returns `false` if all are taken.
    pub(crate) fn begin_cast(&self, most: u32) -> bool {
        let taken = self
            .0
            .casts
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |casts| (casts < most).then_some(casts + 1));
        taken.is_ok()
    }

    pub(super) fn end_cast(&self) {
        // In a replay no slot has been taken.
        let _ = self.0.casts.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |casts| casts.checked_sub(1));
    }

    pub(crate) fn pretend_latency(&self, nanos: i64) {
        self.0.pretended_latency_nanos.store(nanos, Ordering::Relaxed);
    }

    /// Begins a turn of a replay: recorded values of earlier turns are discarded.
    pub(crate) fn begin_replayed_turn(&self) {
        lock(&self.0.replayed_latencies).clear();
        lock(&self.0.replayed_placements).clear();
    }

    /// Sets how long the next measured callback takes in a replay.
    pub(crate) fn replay_latency(&self, nanos: i64) {
        lock(&self.0.replayed_latencies).push_back(nanos);
    }

    /// Sets the transform of an input that the estimator is about to ask for in a replay.
    pub(crate) fn replay_placement(&self, placed: PlacedInput) {
        lock(&self.0.replayed_placements).push_back(placed);
    }

    /// The transform of the input with that number, as recorded in the journal.
    pub(super) fn replayed_placement(&self, input: usize) -> Option<Placement> {
        let mut placements = lock(&self.0.replayed_placements);
        placements.front().filter(|placed| placed.input == input)?;
        placements.pop_front().map(|placed| placed.placement)
    }

    /// The duration of the next measured callback, as recorded in the journal.
    pub(super) fn replayed_latency_nanos(&self) -> Option<i64> {
        lock(&self.0.replayed_latencies).pop_front()
    }

    /// The simulated duration of callbacks on virtual time.
    pub(super) fn pretended_latency_nanos(&self) -> i64 {
        self.0.pretended_latency_nanos.load(Ordering::Relaxed)
    }
}
