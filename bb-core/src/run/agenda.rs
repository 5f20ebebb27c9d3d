//! When estimators are to be woken: for timers, ticks, restarts, and to see whether they are lost.

use crate::time::MonotonicTime;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The islands that something is due in, by time and then by number: the same order in every run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Agenda(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    entries: Mutex<BinaryHeap<Reverse<(MonotonicTime, usize)>>>,
    changed: Condvar,
}

impl Agenda {
    /// Has `island` woken at `time`. One that is woken for nothing goes back to sleep.
    pub(crate) fn wake_at(&self, time: MonotonicTime, island: usize) {
        let mut entries = self.lock();
        let is_first = entries.peek().is_none_or(|Reverse((first, _))| time < *first);
        entries.push(Reverse((time, island)));
        drop(entries);
        if is_first {
            self.0.changed.notify_all();
        }
    }

    pub(crate) fn next(&self) -> Option<MonotonicTime> {
        self.lock().peek().map(|Reverse((time, _))| *time)
    }

    /// Takes the first island that is due at `now`; entries of one island and time are one.
    pub(crate) fn take(&self, now: MonotonicTime) -> Option<usize> {
        let mut entries = self.lock();
        let Reverse(first) = entries.peek().copied().filter(|Reverse((time, _))| *time <= now)?;
        while entries.peek() == Some(&Reverse(first)) {
            entries.pop();
        }
        Some(first.1)
    }

    /// Waits for `duration`, or until an earlier entry is made.
    pub(crate) fn wait(&self, duration: Duration) {
        let entries = self.lock();
        let _ = self.0.changed.wait_timeout(entries, duration);
    }

    /// Wakes whoever waits.
    pub(crate) fn interrupt(&self) {
        drop(self.lock());
        self.0.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, BinaryHeap<Reverse<(MonotonicTime, usize)>>> {
        self.0.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
