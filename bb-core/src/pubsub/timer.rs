//! The clock of the run, for subscriptions with a highest rate.

use crate::time::MonotonicTime;
use std::fmt;
use std::sync::{Arc, OnceLock};
use std::task::Waker;

/// Tells the time and wakes at a time, on whatever clock the robot runs. It is set once that is known: nothing is published before.
/// Clones are the same.
#[derive(Clone, Default)]
pub(crate) struct Timer(Arc<OnceLock<Box<dyn Alarms>>>);

/// Clock and alarms behind a [`Timer`].
pub(crate) trait Alarms: Send + Sync {
    fn now(&self) -> MonotonicTime;
    /// Wakes `waker` at that time, on another thread than the caller's or later on the same one.
    fn wake_at(&self, time: MonotonicTime, waker: Waker);
}

impl Timer {
    pub(crate) fn set(&self, alarms: impl Alarms + 'static) {
        // It is set once.
        let _ = self.0.set(Box::new(alarms));
    }

    pub(super) fn now(&self) -> Option<MonotonicTime> {
        self.0.get().map(|alarms| alarms.now())
    }

    pub(super) fn wake_at(&self, time: MonotonicTime, waker: Waker) {
        if let Some(alarms) = self.0.get() {
            alarms.wake_at(time, waker);
        }
    }
}

impl fmt::Debug for Timer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Timer").field(&self.now()).finish()
    }
}
