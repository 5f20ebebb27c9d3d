//! Futures that wait for a time, in the order of their times and then of their numbers.

use super::{Bell, Lane};
use crate::fault::lock;
use crate::time::MonotonicTime;
use bb_message::__private::Sorted;
use std::sync::{Arc, Mutex};
use std::task::Waker;

/// The alarms that are set. Clones share them.
#[derive(Clone, Debug)]
pub(crate) struct Sleeper {
    alarms: Arc<Mutex<Alarms>>,
    bell: Bell,
    /// The lane that wakes alarms set through this clone.
    lane: Lane,
}

#[derive(Debug, Default)]
struct Alarms {
    set: Sorted<Alarm, (Lane, Waker)>,
    next_number: u64,
}

/// An alarm: its time, and a number of its own.
pub(crate) type Alarm = (MonotonicTime, u64);

impl Sleeper {
    pub(crate) fn new(bell: Bell) -> Self {
        Self { alarms: Arc::default(), bell, lane: Lane::Robot }
    }

    /// A clone whose alarms are woken in another lane than the robot's own.
    pub(crate) fn in_lane(&self, lane: Lane) -> Self {
        Self { lane, ..self.clone() }
    }

    /// Sets an alarm in place of `set`, the one that was set before, if any.
    pub(crate) fn wake_at(&self, time: MonotonicTime, set: Option<Alarm>, waker: Waker) -> Alarm {
        let mut alarms = lock(&self.alarms);
        let alarm = set.unwrap_or((time, alarms.next_number));
        alarms.next_number += 1;
        let replaced = alarms.set.insert(alarm, (self.lane, waker));
        let is_first = alarms.set.first() == Some(&alarm);
        // The lock is released first: dropping a waker may run user code.
        drop(alarms);
        drop(replaced);
        if is_first {
            self.bell.ring();
        }
        alarm
    }

    pub(crate) fn forget(&self, alarm: Alarm) {
        let waker = lock(&self.alarms).set.remove(&alarm);
        drop(waker);
    }

    pub(crate) fn next(&self) -> Option<MonotonicTime> {
        lock(&self.alarms).set.first().map(|(time, _)| *time)
    }

    /// Takes the waker of the first alarm whose time has come.
    pub(crate) fn take(&self, now: MonotonicTime) -> Option<(Lane, Waker)> {
        let mut alarms = lock(&self.alarms);
        alarms.set.first().filter(|(time, _)| *time <= now)?;
        alarms.set.pop_first().map(|(_, waker)| waker)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn an_alarm_is_forgotten_with_its_future_and_set_once() {
        let sleeper = Sleeper::new(Bell::default());
        let (hour, waker) = (MonotonicTime::ZERO + Duration::from_secs(3600), Waker::noop());
        let mut alarm = None;
        for _ in 0..100 {
            alarm = Some(sleeper.wake_at(hour, alarm, waker.clone()));
        }
        sleeper.wake_at(MonotonicTime::ZERO, None, waker.clone());
        let set = lock(&sleeper.alarms).set.len();
        assert_eq!((set, sleeper.next()), (2, Some(MonotonicTime::ZERO)));
        assert!(sleeper.take(MonotonicTime::ZERO).is_some() && sleeper.take(MonotonicTime::ZERO).is_none());
        alarm.into_iter().for_each(|alarm| sleeper.forget(alarm));
        assert_eq!(lock(&sleeper.alarms).set.len(), 0);
    }
}
