//! Tells all threads of a robot to stop, and wakes those that sleep.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Set when the robot is told to stop.
#[doc(hidden)]
#[derive(Clone, Debug, Default)]
pub struct StopSignal(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    set: AtomicBool,
    lock: Mutex<()>,
    changed: Condvar,
}

impl StopSignal {
    pub(crate) fn set(&self) {
        self.0.set.store(true, Ordering::Release);
        // The lock makes sure that nobody is between his last look at the flag and his sleep.
        drop(self.0.lock.lock().unwrap_or_else(PoisonError::into_inner));
        self.0.changed.notify_all();
    }

    pub(crate) fn is_set(&self) -> bool {
        self.0.set.load(Ordering::Acquire)
    }

    /// Sleeps for `duration`, or until the signal is set.
    pub(crate) fn sleep(&self, duration: Duration) {
        let guard = self.0.lock.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = self.0.changed.wait_timeout_while(guard, duration, |()| !self.is_set());
    }
}
