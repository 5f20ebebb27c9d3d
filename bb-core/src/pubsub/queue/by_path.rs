//! Queues that treat each path for itself: they keep the newest of each, or take from each at a highest rate.

use super::{Entry, Queue, State};
use crate::pubsub::delivery::{Delivery, Overflow};
use crate::pubsub::timer::Timer;
use crate::time::MonotonicTime;
use bb_message::__private::Sorted;
use std::mem::{replace, take};
use std::sync::{Arc, Weak};
use std::task::{Wake, Waker};
use std::time::Duration;

/// Part of a queue that works path by path.
#[derive(Debug)]
pub(super) struct ByPath {
    is_latest: bool,
    /// The least time between two messages of one path; zero for any.
    period: Duration,
    timer: Timer,
    /// Wakes the queue.
    alarm: Waker,
}

/// Messages and times of each path.
#[derive(Debug)]
pub(super) struct Paths<M> {
    known: Sorted<&'static str, Path>,
    /// The newest message of each path that waits for its time.
    held: Sorted<(MonotonicTime, &'static str), Entry<M>>,
    /// Number of messages that have left the queue at its front.
    popped: u64,
    /// Number of paths at which those that no longer matter are forgotten.
    clean_at: usize,
    /// The time of the alarm that is set.
    alarm: Option<MonotonicTime>,
    /// Nothing waits for its time any more.
    is_over: bool,
}

#[derive(Clone, Copy, Debug)]
struct Path {
    /// Time from which on the next message is delivered.
    next: MonotonicTime,
    /// The number of its last message in the queue, if that is not among those popped.
    last: u64,
}

impl<M> Default for Paths<M> {
    fn default() -> Self {
        let (known, held) = (Sorted::default(), Sorted::default());
        Self { known, held, popped: 0, clean_at: 64, alarm: None, is_over: false }
    }
}

/// Wakes a queue when a message's time has come.
struct Alarm<M>(Weak<Queue<M>>);

impl<M: Send + 'static> Wake for Alarm<M> {
    fn wake(self: Arc<Self>) {
        if let Some(queue) = self.0.upgrade() {
            queue.ring();
        }
    }
}

impl ByPath {
    /// Creates the queue by path of a delivery that depends on paths.
    pub(super) fn of<M: Send + 'static>(delivery: Delivery, timer: &Timer, queue: &Weak<Queue<M>>) -> Option<Self> {
        let is_latest = delivery.overflow == Overflow::LatestPerPath;
        let alarm = || Arc::new(Alarm(Weak::clone(queue))).into();
        (is_latest || !delivery.period.is_zero()).then(|| Self {
            is_latest,
            period: delivery.period,
            timer: timer.clone(),
            alarm: alarm(),
        })
    }

    /// The time, if there is a highest rate. Before it is known, nothing is published.
    pub(super) fn now(&self) -> Option<MonotonicTime> {
        if self.period.is_zero() { None } else { self.timer.now() }
    }

    pub(super) fn waker(&self) -> Waker {
        self.alarm.clone()
    }

    pub(super) fn wake_at(&self, time: MonotonicTime) {
        self.timer.wake_at(time, self.alarm.clone());
    }
}

/// The messages that are to be dropped without the lock, and how many of them are lost to a slow reader.
pub(super) struct Dropped<M> {
    pub(super) messages: Vec<M>,
    pub(super) lost: u64,
}

impl<M> Default for Dropped<M> {
    fn default() -> Self {
        Self { messages: Vec::new(), lost: 0 }
    }
}

impl<M> Queue<M> {
    /// A message of `path` arrives.
    pub(super) fn arrive(
        &self,
        by: &ByPath,
        state: &mut State<M>,
        path: &'static str,
        entry: Entry<M>,
    ) -> Dropped<M> {
        let mut dropped = Dropped::default();
        let Some(now) = by.now().filter(|_| !state.paths.is_over) else {
            self.enter(by, state, path, entry, START, &mut dropped);
            return dropped;
        };
        self.release(by, state, now, &mut dropped);
        match state.paths.known.get(path).map(|path| path.next).filter(|next| *next > now) {
            Some(next) => {
                let before = state.paths.held.insert((next, path), entry);
                dropped.messages.extend(before.map(|entry| entry.message));
            }
            None => self.enter(by, state, path, entry, now, &mut dropped),
        }
        dropped
    }

    /// Delivers what waits for a time until `now`, as if it had been delivered at that time.
    pub(super) fn release(&self, by: &ByPath, state: &mut State<M>, now: MonotonicTime, dropped: &mut Dropped<M>) {
        while state.paths.held.first().is_some_and(|(due, _)| *due <= now) {
            let Some(((due, path), entry)) = state.paths.held.pop_first() else { return };
            self.enter(by, state, path, entry, due, dropped);
        }
    }

    /// Puts a message into the queue, at a time.
    fn enter(
        &self,
        by: &ByPath,
        state: &mut State<M>,
        path: &'static str,
        entry: Entry<M>,
        time: MonotonicTime,
        dropped: &mut Dropped<M>,
    ) {
        let next = time + by.period;
        let last = state.paths.known.get(path).map(|path| path.last);
        let waiting = last.filter(|_| by.is_latest).and_then(|last| last.checked_sub(state.paths.popped));
        let index = waiting.and_then(|index| usize::try_from(index).ok());
        if let Some(before) = index.and_then(|index| state.messages.get_mut(index)) {
            state.bytes = state.bytes - before.bytes + entry.bytes;
            dropped.messages.push(replace(before, entry).message);
            (dropped.lost, state.lagged) = (dropped.lost + 1, state.lagged + 1);
            if let Some(path) = state.paths.known.get_mut(path) {
                path.next = next;
            }
            return;
        }
        while !self.has_room(state, entry.bytes) {
            dropped.messages.extend(state.pop());
            (dropped.lost, state.lagged) = (dropped.lost + 1, state.lagged + 1);
        }
        let last = state.paths.popped + state.messages.len() as u64;
        state.bytes += entry.bytes;
        state.messages.push_back(entry);
        state.paths.remember(path, Path { next, last }, time);
    }
}

/// The time of all messages where there is no highest rate.
const START: MonotonicTime = MonotonicTime::from_nanos(i64::MIN);

impl<M> Paths<M> {
    /// Counts a message that has left at the front.
    pub(super) fn take(&mut self) {
        self.popped += 1;
    }

    /// Stores what is known of a path at that time.
    fn remember(&mut self, name: &'static str, path: Path, now: MonotonicTime) {
        if self.known.len() >= self.clean_at {
            let popped = self.popped;
            let known = take(&mut self.known).into_entries();
            for (name, path) in known.filter(|(_, path)| path.last >= popped || path.next > now) {
                self.known.insert(name, path);
            }
            self.clean_at = (2 * self.known.len()).max(64);
        }
        self.known.insert(name, path);
    }

    /// Returns whether a message waits for its time, and no alarm is set for it.
    pub(super) fn needs_alarm(&self) -> bool {
        self.held.first().is_some_and(|(due, _)| self.alarm.is_none_or(|alarm| alarm > *due))
    }

    /// The time of the alarm that is to be set, if one is.
    pub(super) fn arm(&mut self) -> Option<MonotonicTime> {
        if !self.needs_alarm() {
            return None;
        }
        self.alarm = self.held.first().map(|(due, _)| *due);
        self.alarm
    }

    /// The alarm has rung, if its time has come.
    pub(super) fn rang(&mut self, now: MonotonicTime) {
        self.alarm = self.alarm.filter(|alarm| *alarm > now);
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.known.len()
    }

    /// Delivers every message at once from now on.
    pub(super) fn end(&mut self) {
        self.is_over = true;
    }

    /// Takes out all that waits for its time.
    pub(super) fn clear(&mut self) -> impl Iterator<Item = M> + use<M> {
        take(&mut self.held).into_entries().map(|(_, entry)| entry.message)
    }
}
