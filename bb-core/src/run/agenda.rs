//! When estimators are to be woken: for timers, ticks, restarts, and to see whether they are lost.

use crate::time::{Clock, MonotonicTime};
use std::collections::BTreeSet;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The islands that something is due in, by time and then by number: the same order in every run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Agenda(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    entries: Mutex<Entries>,
    changed: Condvar,
}

/// One entry for each island at most, its earliest: whoever is woken says anew when to be woken next.
#[derive(Debug, Default)]
struct Entries {
    by_time: BTreeSet<(MonotonicTime, usize)>,
    of: Vec<Option<MonotonicTime>>,
    /// Whoever waits is to look around.
    is_interrupted: bool,
}

impl Agenda {
    /// Has `island` woken at `time`, or before. One that is woken for nothing goes back to sleep.
    pub(crate) fn wake_at(&self, time: MonotonicTime, island: usize) {
        // The last instant is one that never comes.
        if time == MonotonicTime::MAX {
            return;
        }
        let mut entries = self.lock();
        if entries.of.len() <= island {
            entries.of.resize(island + 1, None);
        }
        if entries.of[island].is_some_and(|earlier| earlier <= time) {
            return;
        }
        if let Some(later) = entries.of[island].replace(time) {
            entries.by_time.remove(&(later, island));
        }
        entries.by_time.insert((time, island));
        let is_first = entries.by_time.first() == Some(&(time, island));
        drop(entries);
        if is_first {
            self.0.changed.notify_all();
        }
    }

    pub(crate) fn next(&self) -> Option<MonotonicTime> {
        self.lock().next()
    }

    /// Takes the first island that is due at `now`.
    pub(crate) fn take(&self, now: MonotonicTime) -> Option<usize> {
        let mut entries = self.lock();
        entries.next().filter(|time| *time <= now)?;
        let (_, island) = entries.by_time.pop_first()?;
        if let Some(slot) = entries.of.get_mut(island) {
            *slot = None;
        }
        Some(island)
    }

    /// Waits until something is due, or until it is interrupted; `longest` at most.
    pub(crate) fn wait(&self, clock: &Clock, longest: Duration) {
        // Under one lock from the look to the sleep, so that no entry is made between.
        let mut entries = self.lock();
        let mut left = longest;
        while !std::mem::take(&mut entries.is_interrupted) {
            let due = entries.next().map_or(longest, |next| next.duration_since(clock.now()));
            let wait = due.min(left);
            if wait.is_zero() {
                return;
            }
            let start = clock.now();
            entries = self.0.changed.wait_timeout(entries, wait).unwrap_or_else(PoisonError::into_inner).0;
            left = left.saturating_sub(clock.now().duration_since(start));
        }
    }

    /// Wakes whoever waits.
    pub(crate) fn interrupt(&self) {
        self.lock().is_interrupted = true;
        self.0.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Entries> {
        self.0.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entries {
    fn next(&self) -> Option<MonotonicTime> {
        self.by_time.first().map(|(time, _)| *time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(nanos: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(nanos)
    }

    #[test]
    fn an_island_has_one_entry_its_earliest() {
        let agenda = Agenda::default();
        for nanos in (100..1_000_000).rev() {
            agenda.wake_at(at(nanos), 3);
        }
        agenda.wake_at(at(500), 3);
        agenda.wake_at(at(100), 1);
        agenda.wake_at(MonotonicTime::MAX, 0);
        assert_eq!(agenda.lock().by_time.len(), 2);
        assert_eq!((agenda.take(at(99)), agenda.next()), (None, Some(at(100))));
        let taken: Vec<_> = std::iter::from_fn(|| agenda.take(at(1_000_000))).collect();
        assert_eq!(taken, [1, 3]);
    }

    /// One that went unnoticed would cost 200 ms.
    #[test]
    fn no_entry_goes_unnoticed() {
        let (agenda, clock) = (Agenda::default(), Clock::real());
        let start = clock.now();
        std::thread::scope(|scope| {
            let (taken, next) = std::sync::mpsc::channel();
            let (agenda, clock) = (&agenda, &clock);
            scope.spawn(move || {
                for _ in 0..5_000 {
                    while agenda.take(clock.now()).is_none() {
                        agenda.wait(clock, Duration::from_millis(200));
                    }
                    taken.send(()).expect("somebody listens");
                }
            });
            for round in 0..5_000 {
                (0..round % 50).for_each(|_| std::hint::spin_loop());
                agenda.wake_at(clock.now(), 0);
                next.recv().expect("it is taken");
            }
        });
        assert!(clock.now().duration_since(start) < Duration::from_secs(10));
    }
}
