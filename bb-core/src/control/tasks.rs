//! Commands that run: futures on the robot's own clock, so that a simulated one takes virtual time and every run is the
//! same. Whoever drives the robot polls them; nothing here has a thread.

use super::execution::{CommandError, Slot};
use crate::component::Fault;
use crate::node::HealthTransition;
use crate::time::MonotonicTime;
use std::any::Any;
use std::cmp::Ordering as Compared;
use std::collections::BinaryHeap;
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
    signal: Arc<Signal>,
}

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
        future: Running,
        bell: Bell,
    ) -> Self {
        let signal = Signal { woken: AtomicBool::new(true), cancelled: AtomicBool::new(false), bell };
        let signal = Arc::new(signal);
        let slot = Arc::new(Slot::new(Arc::clone(&signal)));
        Self { id, command, health, deadline, slot, future: Mutex::new(Some(future)), signal }
    }

    pub(super) fn cancel(&self) {
        self.signal.cancel();
    }

    /// Whether [`Self::poll`] would do anything at `now`.
    pub(super) fn is_due(&self, now: MonotonicTime) -> bool {
        self.signal.woken.load(Ordering::Acquire)
            || self.signal.cancelled.load(Ordering::Acquire)
            || self.deadline.is_some_and(|deadline| deadline <= now)
    }

    /// Goes on with it; how it has ended, if it has. User code runs here: a panic fails the command.
    pub(super) fn poll(&self, now: MonotonicTime) -> Option<Result<super::Outcome<Value>, CommandError>> {
        let mut future = lock(&self.future).take()?;
        let ended = if self.signal.cancelled.load(Ordering::Acquire) {
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
        if ended.is_none() {
            *lock(&self.future) = Some(future);
        } else {
            // Dropping it is the command's clean-up.
            let _ = crate::run::caught(|| {
                drop(future);
                Ok(())
            });
        }
        ended
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

/// Futures that wait for a time.
#[derive(Clone, Debug, Default)]
pub(super) struct Sleeper(Arc<Mutex<BinaryHeap<Alarm>>>);

#[derive(Debug)]
struct Alarm {
    time: MonotonicTime,
    waker: Waker,
}

impl Sleeper {
    pub(super) fn wake_at(&self, time: MonotonicTime, waker: Waker) {
        let mut alarms = lock(&self.0);
        // A future that is polled again before its time is in here already.
        if !alarms.iter().any(|alarm| alarm.time == time && alarm.waker.will_wake(&waker)) {
            alarms.push(Alarm { time, waker });
        }
    }

    pub(super) fn next(&self) -> Option<MonotonicTime> {
        lock(&self.0).peek().map(|alarm| alarm.time)
    }

    /// Wakes all whose time has come.
    pub(super) fn advance(&self, now: MonotonicTime) {
        loop {
            let mut alarms = lock(&self.0);
            if alarms.peek().is_none_or(|alarm| alarm.time > now) {
                return;
            }
            let alarm = alarms.pop();
            drop(alarms);
            if let Some(Alarm { waker, .. }) = alarm {
                waker.wake();
            }
        }
    }
}

// The earliest is the greatest: a heap gives the greatest first.
impl Ord for Alarm {
    fn cmp(&self, other: &Self) -> Compared {
        other.time.cmp(&self.time)
    }
}

impl PartialOrd for Alarm {
    fn partial_cmp(&self, other: &Self) -> Option<Compared> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Alarm {
    fn eq(&self, other: &Self) -> bool {
        self.time == other.time
    }
}

impl Eq for Alarm {}

impl fmt::Debug for Task {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Task").field("id", &self.id).field("command", &self.command).finish_non_exhaustive()
    }
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
