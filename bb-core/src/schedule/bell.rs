//! Wakes the thread that keeps time.

use crate::fault::lock;
use crate::time::{Clock, MonotonicTime};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Rung when something may be due earlier than the waiting thread knows. Clones are the same bell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bell(Arc<(Mutex<bool>, Condvar)>);

impl Bell {
    pub(crate) fn ring(&self) {
        *lock(&self.0.0) = true;
        self.0.1.notify_all();
    }

    /// Waits until it rings or `due` has come, `longest` at most.
    pub(crate) fn wait_until(&self, clock: &Clock, due: Option<MonotonicTime>, longest: Duration) {
        let has_rung = lock(&self.0.0);
        let wait = due.map_or(longest, |due| due.duration_since(clock.now()).min(longest));
        let waited = self.0.1.wait_timeout_while(has_rung, wait, |has_rung| !*has_rung);
        *waited.unwrap_or_else(PoisonError::into_inner).0 = false;
    }
}
