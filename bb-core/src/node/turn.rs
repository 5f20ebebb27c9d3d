//! One entry that an island processes.

use super::admission::MAX_SKEW_NANOS;
use super::environment::{Environment, Mode};
use super::timing::Timing;
use crate::declaration::{EstimatorDeclaration, IslandDeclaration};
use crate::joints::PlacedInput;
use crate::journal::{Callback, Event, Recorded, checksum};
use crate::message::{Payload, Stamped};
use crate::pubsub::{AnyTopic as _, DynamicMessage, Topic};
use crate::time::{MonotonicTime, WallTime};
use std::cell::{Cell, RefCell};
use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering};

/// The processing of one entry: its time, its measurements, and its records for the journal.
pub struct Turn<'a> {
    now: MonotonicTime,
    /// The latest stamp that is accepted.
    latest: MonotonicTime,
    wall_offset_nanos: i64,
    environment: &'a Environment,
    island: usize,
    is_observed: bool,
    /// The estimator whose callback runs or ran last, used to report one that hangs.
    running: &'a AtomicU32,
    timing: Timing,
    /// Durations of measured callbacks, if there is a journal.
    measured: RefCell<Vec<Callback>>,
    /// Transforms of inputs across moving joints, if there is a journal.
    placed: RefCell<Vec<PlacedInput>>,
    /// The estimator whose callback runs now, if the request it answers is not in the journal.
    answering: Cell<Option<&'static EstimatorDeclaration>>,
    /// The estimator whose outputs answer such a request.
    unrecorded: Cell<Option<&'static EstimatorDeclaration>>,
    /// `true` if the most recent callback has already emitted at one of its outputs.
    has_emitted: Cell<bool>,
}

impl<'a> Turn<'a> {
    pub(super) fn new(
        environment: &'a Environment,
        island: usize,
        now: MonotonicTime,
        wall_offset_nanos: i64,
        running: &'a AtomicU32,
    ) -> Self {
        Self {
            now,
            latest: now.plus_nanos(MAX_SKEW_NANOS),
            wall_offset_nanos,
            environment,
            island,
            is_observed: environment.is_observed(),
            running,
            timing: Timing::default(),
            measured: RefCell::default(),
            placed: RefCell::default(),
            answering: Cell::new(None),
            unrecorded: Cell::new(None),
            has_emitted: Cell::new(false),
        }
    }

    /// The time of the entry.
    #[inline]
    pub fn now(&self) -> MonotonicTime {
        self.now
    }

    /// The latest stamp that a message may have: further ahead, its clock is wrong.
    #[inline]
    pub(super) fn latest(&self) -> MonotonicTime {
        self.latest
    }

    pub(super) fn wall_at(&self, time: MonotonicTime) -> WallTime {
        WallTime::from_unix_nanos(time.as_nanos().saturating_add(self.wall_offset_nanos))
    }

    #[inline]
    pub(super) fn environment(&self) -> &'a Environment {
        self.environment
    }

    #[inline]
    pub(super) fn is_observed(&self) -> bool {
        self.is_observed
    }

    /// Notes that a turn of `estimator` begins.
    #[inline]
    pub(super) fn enter(&self, estimator: u32) {
        self.running.store(estimator, Ordering::Relaxed);
    }

    /// Notes that another island was entered in this turn, whose time is not charged to the next callback.
    #[inline]
    pub fn left_for_another_island(&self) {
        self.timing.interrupt();
    }

    #[inline]
    pub(super) fn timing(&self) -> &Timing {
        &self.timing
    }

    /// Records how long a callback took, for the journal.
    pub(super) fn keep(&self, estimator: usize, nanos: i64) {
        if self.environment.journal().is_some() {
            self.measured.borrow_mut().push(Callback { estimator, nanos });
        }
    }

    pub(super) fn take_measured(&self) -> Vec<Callback> {
        self.measured.take()
    }

    /// Records where an input was, for the journal.
    pub(super) fn keep_placed(&self, placed: PlacedInput) {
        if self.environment.journal().is_some() {
            self.placed.borrow_mut().push(placed);
        }
    }

    pub(super) fn take_placed(&self) -> Vec<PlacedInput> {
        self.placed.take()
    }

    /// Writes what a turn of this island has found besides its outputs. `cause` is the number of its line.
    pub(super) fn write_found(&self, cause: u64, island: &IslandDeclaration) {
        if island.is_measured {
            self.write(|turn| Event::Measured { cause, callbacks: turn.take_measured() });
        }
        if self.environment.joints().routes().has_any(island.estimators) {
            self.write(|turn| Event::Placed { cause, inputs: turn.take_placed() });
        }
    }

    /// Writes a line of this turn, if there is a journal.
    pub(super) fn write(&self, line: impl FnOnce(&Self) -> Event) {
        if let Some(journal) = self.environment.journal() {
            journal.write(self.now, self.wall_offset_nanos, line(self));
        }
    }

    /// Records the outputs of `estimator` in place of the request that it is about to answer, which is not in the journal. The outputs
    /// of other estimators follow from these.
    pub(super) fn set_unrecorded(&self, estimator: &'static EstimatorDeclaration) {
        self.answering.set(Some(estimator));
    }

    /// Records that a callback has emitted nothing.
    pub(super) fn no_emission(&self) {
        self.answering.set(None);
    }

    /// Records whether a callback of `estimator` has emitted at one or more outputs. Callbacks of other estimators may run before those
    /// are published.
    #[cold]
    pub(super) fn note_reply(&self, estimator: &'static EstimatorDeclaration, has_emitted: bool) {
        let answering = self.answering.take();
        if has_emitted && answering.is_some() {
            self.unrecorded.set(answering);
            self.has_emitted.set(false);
        } else if has_emitted && self.unrecorded.get().is_some_and(|unrecorded| unrecorded.path == estimator.path) {
            self.unrecorded.set(None);
        }
    }

    /// Publishes `message`, which an estimator emits, at the publisher with that number.
    #[inline]
    pub fn emit<T: Payload>(&self, publisher: usize, topic: &Topic<T>, message: &Stamped<T>) {
        if T::TELLS_JOINT_POSITION || self.is_observed || topic.is_listened_to() {
            self.hand_out(publisher, topic, message);
        } else {
            topic.count_alone();
        }
    }

    #[cold]
    fn hand_out<T: Payload>(&self, publisher: usize, topic: &Topic<T>, message: &Stamped<T>) {
        // Copies for subscribers may take longer than the next callback.
        self.timing.interrupt();
        if T::TELLS_JOINT_POSITION {
            self.environment.joints().hear(message, self.now);
        }
        if self.is_observed {
            self.follow(publisher, topic.path(), message);
        }
        topic.publish(message);
    }

    fn follow<T: Payload>(&self, publisher: usize, path: &'static str, message: &Stamped<T>) {
        if self.environment.journal().is_some() {
            let is_answer = self.unrecorded.get().is_some_and(|estimator| estimator.outputs.contains(&path));
            let event = if is_answer {
                let message = Recorded::Message(DynamicMessage::new(path, message));
                Event::Emission { publisher, is_first: !self.has_emitted.replace(true), message }
            } else {
                Event::Output { island: self.island, publisher, checksum: checksum(message) }
            };
            self.write(|_| event);
        }
        if self.environment.mode() == Mode::Replay {
            self.environment.replayed().add(self.island, publisher, checksum(message));
        }
        if let Some(telemetry) = self.environment.telemetry() {
            telemetry.output(self.environment.origin().robot, path, message, self.environment.clock().now());
        }
    }
}

impl fmt::Debug for Turn<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Turn").field("now", &self.now).finish_non_exhaustive()
    }
}
