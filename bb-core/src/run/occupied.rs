//! Time at which a thread entered a component's code.

use crate::time::{Clock, MonotonicTime};
use std::sync::atomic::{AtomicI64, Ordering};

/// Time at which a component's code was entered: to report code that hangs.
#[derive(Debug)]
pub(super) struct Occupied(AtomicI64);

/// None of its code runs.
const OUTSIDE: i64 = i64::MIN;

impl Occupied {
    pub(super) fn new() -> Self {
        Self(AtomicI64::new(OUTSIDE))
    }

    /// Returns the time at which the code was entered, if a thread is inside.
    pub(super) fn entered_at(&self) -> Option<MonotonicTime> {
        let nanos = self.0.load(Ordering::Acquire);
        (nanos != OUTSIDE).then(|| MonotonicTime::from_nanos(nanos))
    }

    pub(super) fn enter(&self, clock: &Clock) -> Entered<'_> {
        self.0.store(clock.now().as_nanos(), Ordering::Release);
        Entered(self)
    }
}

/// The code of a component runs until this is dropped.
pub(super) struct Entered<'a>(&'a Occupied);

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        self.0.0.store(OUTSIDE, Ordering::Release);
    }
}
