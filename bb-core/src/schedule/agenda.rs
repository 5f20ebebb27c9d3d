//! Times at which to wake each island: for timers, ticks and restarts.

use super::Bell;
use crate::fault::lock;
use crate::time::MonotonicTime;
use bb_message::__private::Sorted;
use std::sync::{Arc, Mutex};

/// Islands with something due, ordered by time and then by number, so the order is the same in every run.
#[derive(Clone, Debug)]
pub(crate) struct Agenda {
    entries: Arc<Mutex<Entries>>,
    bell: Bell,
}

/// Entries of the agenda. At most one per island, its earliest: an island that is woken says when to wake it next.
#[derive(Debug, Default)]
struct Entries {
    by_time: Sorted<(MonotonicTime, usize), ()>,
    of: Vec<Option<MonotonicTime>>,
}

impl Agenda {
    pub(crate) fn new(bell: Bell) -> Self {
        Self { entries: Arc::default(), bell }
    }

    /// Wakes `island` at `time` or earlier. An island with nothing to do goes back to sleep.
    pub(crate) fn wake_at(&self, time: MonotonicTime, island: usize) {
        // The last instant never comes.
        if time == MonotonicTime::MAX {
            return;
        }
        let mut entries = lock(&self.entries);
        if entries.of.len() <= island {
            entries.of.resize(island + 1, None);
        }
        if entries.of[island].is_some_and(|earlier| earlier <= time) {
            return;
        }
        if let Some(later) = entries.of[island].replace(time) {
            entries.by_time.remove(&(later, island));
        }
        entries.by_time.insert((time, island), ());
        let is_first = entries.by_time.first() == Some(&(time, island));
        drop(entries);
        if is_first {
            self.bell.ring();
        }
    }

    pub(crate) fn next(&self) -> Option<MonotonicTime> {
        lock(&self.entries).next()
    }

    /// Takes the first island that is due at `now`.
    pub(crate) fn take(&self, now: MonotonicTime) -> Option<usize> {
        let mut entries = lock(&self.entries);
        entries.next().filter(|time| *time <= now)?;
        let ((_, island), ()) = entries.by_time.pop_first()?;
        if let Some(slot) = entries.of.get_mut(island) {
            *slot = None;
        }
        Some(island)
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
    use crate::time::Clock;
    use std::time::Duration;

    fn at(nanos: i64) -> MonotonicTime {
        MonotonicTime::from_nanos(nanos)
    }

    #[test]
    fn an_island_has_one_entry_its_earliest() {
        let agenda = Agenda::new(Bell::default());
        for nanos in (100..1_000_000).rev() {
            agenda.wake_at(at(nanos), 3);
        }
        agenda.wake_at(at(500), 3);
        agenda.wake_at(at(100), 1);
        agenda.wake_at(MonotonicTime::MAX, 0);
        assert_eq!(lock(&agenda.entries).by_time.len(), 2);
        assert_eq!((agenda.take(at(99)), agenda.next()), (None, Some(at(100))));
        let taken: Vec<_> = std::iter::from_fn(|| agenda.take(at(1_000_000))).collect();
        assert_eq!(taken, [1, 3]);
    }

    /// A missed wake-up would cost 200 ms.
    #[test]
    fn no_entry_goes_unnoticed() {
        let bell = Bell::default();
        let (agenda, clock) = (Agenda::new(bell.clone()), Clock::real());
        let start = clock.now();
        std::thread::scope(|scope| {
            let (taken, next) = std::sync::mpsc::channel();
            let (agenda, clock, bell) = (&agenda, &clock, &bell);
            scope.spawn(move || {
                for _ in 0..5_000 {
                    while agenda.take(clock.now()).is_none() {
                        bell.wait_until(clock, agenda.next(), Duration::from_millis(200));
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
