//! Commands that run: futures on the robot's own clock, so that a simulated one takes virtual time and every run is the
//! same. Whoever drives the robot polls them; nothing here has a thread.

use super::execution::{CommandError, Slot};
use crate::component::Fault;
use crate::node::HealthTransition;
use crate::time::MonotonicTime;
use std::any::Any;
use std::collections::BTreeMap;
use std::fmt;
use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};
use std::time::Duration;

/// What a command gives, whatever its type.
pub(super) type Value = Box<dyn Any + Send>;
pub(super) type Ended = Result<super::Outcome<Value>, Fault>;
pub(super) type Running = Pin<Box<dyn Future<Output = Ended> + Send>>;

/// One execution of a command.
pub(super) struct Task {
    pub(super) id: u64,
    /// The number of its command.
    pub(super) command: usize,
    pub(super) health: Option<HealthTransition>,
    pub(super) deadline: Option<MonotonicTime>,
    pub(super) slot: Arc<Slot>,
    future: Mutex<Option<Running>>,
    /// Whether the future is here: not before [`Self::begin`], nor while somebody polls it, nor once it has ended.
    is_here: AtomicBool,
    has_begun: AtomicBool,
    /// When it was polled last, and how often at that instant.
    polled: Mutex<(MonotonicTime, u32)>,
    signal: Arc<Signal>,
}

/// Polls at one instant of virtual time before a command is taken to be stuck.
const STUCK_AFTER: u32 = 1_000_000;

/// Set by wakers and by whoever cancels.
#[derive(Debug)]
pub(super) struct Signal {
    woken: AtomicBool,
    cancelled: AtomicBool,
    bell: Bell,
}

impl Signal {
    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Release);
        self.bell.ring();
    }
}

impl Wake for Signal {
    fn wake(self: Arc<Self>) {
        self.woken.store(true, Ordering::Release);
        self.bell.ring();
    }
}

impl Task {
    pub(super) fn new(
        id: u64,
        command: usize,
        health: Option<HealthTransition>,
        deadline: Option<MonotonicTime>,
        bell: Bell,
    ) -> Self {
        let signal = Signal { woken: AtomicBool::new(true), cancelled: AtomicBool::new(false), bell };
        let signal = Arc::new(signal);
        Self {
            id,
            command,
            health,
            deadline,
            slot: Arc::new(Slot::new(Arc::clone(&signal))),
            future: Mutex::new(None),
            is_here: AtomicBool::new(false),
            has_begun: AtomicBool::new(false),
            polled: Mutex::new((MonotonicTime::MAX, 0)),
            signal,
        }
    }

    /// Takes what it is to do.
    pub(super) fn begin(&self, future: Running) {
        self.has_begun.store(true, Ordering::Release);
        self.put(future);
        self.signal.bell.ring();
    }

    pub(super) fn cancel(&self) {
        self.signal.cancel();
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.signal.cancelled.load(Ordering::Acquire)
    }

    /// Whether it has begun.
    pub(super) fn has_begun(&self) -> bool {
        self.has_begun.load(Ordering::Acquire)
    }

    /// Whether [`Self::poll`] would do anything at `now`.
    pub(super) fn is_due(&self, now: MonotonicTime) -> bool {
        let has_cause = || {
            self.signal.woken.load(Ordering::Acquire)
                || self.is_cancelled()
                || self.deadline.is_some_and(|deadline| deadline <= now)
        };
        self.is_here.load(Ordering::Acquire) && has_cause()
    }

    fn put(&self, future: Running) {
        *lock(&self.future) = Some(future);
        self.is_here.store(true, Ordering::Release);
    }

    /// Goes on with it; how it has ended, if it has. User code runs here: a panic fails the command. One that wakes itself
    /// again and again would keep virtual time from going on: it fails as well.
    pub(super) fn poll(
        &self,
        now: MonotonicTime,
        is_virtual: bool,
    ) -> Option<Result<super::Outcome<Value>, CommandError>> {
        let mut future = lock(&self.future).take()?;
        self.is_here.store(false, Ordering::Release);
        let ended = if self.is_cancelled() {
            Some(Err(CommandError::Cancelled))
        } else if self.signal.woken.swap(false, Ordering::AcqRel) {
            let waker = Waker::from(Arc::clone(&self.signal));
            let polled = crate::run::caught(|| Ok(future.as_mut().poll(&mut Context::from_waker(&waker))));
            match polled {
                Ok(Poll::Pending) => None,
                Ok(Poll::Ready(Ok(outcome))) => Some(Ok(outcome)),
                Ok(Poll::Ready(Err(fault))) => Some(Err(CommandError::Failed(fault.to_string()))),
                Err(failed) => Some(Err(CommandError::Failed(failed.fault.to_string()))),
            }
        } else {
            None
        };
        // What is ready at its deadline has made it.
        let is_late = || self.deadline.is_some_and(|deadline| deadline <= now);
        let ended = ended.or_else(|| is_late().then_some(Err(CommandError::TimedOut)));
        let ended = ended.or_else(|| self.is_stuck(now, is_virtual).map(Err));
        if ended.is_none() {
            self.put(future);
        } else {
            // Dropping it is the command's clean-up.
            let _ = crate::run::caught(|| {
                drop(future);
                Ok(())
            });
        }
        ended
    }

    /// Why it is stuck, if it is.
    fn is_stuck(&self, now: MonotonicTime, is_virtual: bool) -> Option<CommandError> {
        if !is_virtual {
            return None;
        }
        let mut polled = lock(&self.polled);
        *polled = if polled.0 == now { (now, polled.1 + 1) } else { (now, 1) };
        (polled.1 >= STUCK_AFTER).then(|| {
            CommandError::Failed(format!(
                "it woke itself {STUCK_AFTER} times at {now}, and virtual time cannot go on: await \
                 `CommandContext::sleep` between two looks"
            ))
        })
    }
}

/// Wakes whoever polls the commands.
#[derive(Clone, Debug, Default)]
pub(super) struct Bell(Arc<(Mutex<bool>, Condvar)>);

impl Bell {
    pub(super) fn ring(&self) {
        *lock(&self.0.0) = true;
        self.0.1.notify_all();
    }

    /// Waits until it rings, `duration` at most.
    pub(super) fn wait(&self, duration: Duration) {
        let rung = lock(&self.0.0);
        let result = self.0.1.wait_timeout_while(rung, duration, |rung| !*rung);
        *result.unwrap_or_else(PoisonError::into_inner).0 = false;
    }
}

/// Futures that wait for a time, in the order of their times and then of their numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct Sleeper(Arc<Mutex<Alarms>>);

#[derive(Debug, Default)]
struct Alarms {
    set: BTreeMap<Alarm, Waker>,
    next_number: u64,
}

/// One that was set: its time, and a number of its own.
pub(super) type Alarm = (MonotonicTime, u64);

impl Sleeper {
    /// Sets an alarm; `set` is the one that was set before, if any.
    pub(super) fn wake_at(&self, time: MonotonicTime, set: Option<Alarm>, waker: Waker) -> Alarm {
        let mut alarms = lock(&self.0);
        let alarm = set.unwrap_or((time, alarms.next_number));
        alarms.next_number += 1;
        let replaced = alarms.set.insert(alarm, waker);
        // Whatever a waker does when it is dropped, it does without the lock.
        drop(alarms);
        drop(replaced);
        alarm
    }

    /// Whoever has set it does not wait any more.
    pub(super) fn forget(&self, alarm: Alarm) {
        let waker = lock(&self.0).set.remove(&alarm);
        drop(waker);
    }

    pub(super) fn next(&self) -> Option<MonotonicTime> {
        lock(&self.0).set.first_key_value().map(|((time, _), _)| *time)
    }

    /// Wakes all whose time has come.
    pub(super) fn advance(&self, now: MonotonicTime) {
        loop {
            let mut alarms = lock(&self.0);
            let Some(first) = alarms.set.first_entry().filter(|first| first.key().0 <= now) else { return };
            let waker = first.remove();
            drop(alarms);
            crate::run::wake(waker);
        }
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        lock(&self.0).set.len()
    }
}

impl fmt::Debug for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Task").field("id", &self.id).field("command", &self.command).finish_non_exhaustive()
    }
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_is_forgotten_with_whoever_set_it_and_set_once() {
        let sleeper = Sleeper::default();
        let (hour, waker) = (MonotonicTime::ZERO + Duration::from_secs(3600), Waker::noop());
        let mut alarm = None;
        for _ in 0..100 {
            alarm = Some(sleeper.wake_at(hour, alarm, waker.clone()));
        }
        sleeper.wake_at(MonotonicTime::ZERO, None, waker.clone());
        assert_eq!((sleeper.len(), sleeper.next()), (2, Some(MonotonicTime::ZERO)));
        sleeper.advance(MonotonicTime::ZERO);
        alarm.into_iter().for_each(|alarm| sleeper.forget(alarm));
        assert_eq!(sleeper.len(), 0);
    }
}
