//! Code that hangs until a test lets it go on, and what is waited for meanwhile.

use crate::components::{Doing, Done, lock, within};
use bb_core::ComponentFault;
use bb_core::prelude::*;
use std::collections::BTreeMap;
use std::panic::Location;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Longer than anything takes that does not hang, however busy the machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

/// Waits until `holds`, however busy the machine.
pub(crate) fn wait_until(what: &str, holds: impl FnMut() -> bool) {
    assert!(holds_within(PATIENCE, holds), "not reached: {what}");
}

/// Waits until `holds`, for so long at most; whether it does.
pub(crate) fn holds_within(limit: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let start = std::time::Instant::now();
    while !holds() {
        if start.elapsed() >= limit {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    true
}

/// Keeps the other tests of the caller's file waiting: they share devices, or a place at which code hangs.
#[track_caller]
pub(crate) fn one_at_a_time() -> MutexGuard<'static, ()> {
    static OF_FILES: Mutex<BTreeMap<&str, &Mutex<()>>> = Mutex::new(BTreeMap::new());
    let of_file = *lock(&OF_FILES).entry(Location::caller().file()).or_insert_with(|| Box::leak(Box::default()));
    lock(of_file)
}

/// Runs a test that might hang, alone among those of its file; panics if it is not over after `seconds`.
#[track_caller]
pub(crate) fn alone_within(seconds: u64, test: impl FnOnce() + Send + 'static) {
    let _alone = one_at_a_time();
    within(seconds, test);
}

/// Waits for a fault at `path`, and returns its message.
pub(crate) fn fault_of(faults: &Subscription<ComponentFault>, path: &str) -> String {
    let mut faults = std::iter::from_fn(|| faults.recv_timeout(PATIENCE));
    let fault = faults.find(|fault| fault.path == path);
    fault.unwrap_or_else(|| panic!("no fault of {path}")).payload.message
}

/// A place at which code waits until the test lets it go on.
#[derive(Debug, Default)]
pub(crate) struct Gate {
    /// The place that is closed, and how many have come there.
    state: Mutex<(Option<&'static str>, u32)>,
    changed: Condvar,
}

impl Gate {
    pub(crate) const fn new() -> Self {
        Self { state: Mutex::new((None, 0)), changed: Condvar::new() }
    }

    fn lock(&self) -> MutexGuard<'_, (Option<&'static str>, u32)> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn close(&self, place: &'static str) {
        *self.lock() = (Some(place), 0);
        // Who waits at another place goes on.
        self.changed.notify_all();
    }

    pub(crate) fn open(&self) {
        self.lock().0 = None;
        self.changed.notify_all();
    }

    pub(crate) fn pass(&self, place: &'static str) {
        let mut state = self.lock();
        if state.0 == Some(place) {
            state.1 += 1;
            self.changed.notify_all();
        }
        while state.0 == Some(place) {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Passes, as code that returns nothing.
    pub(crate) fn done(&self, place: &'static str) -> Done {
        self.pass(place);
        Ok(())
    }

    /// Code of a task that blocks its thread at a place.
    pub(crate) fn stuck(&'static self, place: &'static str) -> Doing {
        Box::pin(async move {
            self.pass(place);
            Ok(Outcome::done(()))
        })
    }

    /// Waits until so many wait there.
    pub(crate) fn wait_for(&self, many: u32) {
        let state = self.lock();
        let waited = self.changed.wait_timeout_while(state, PATIENCE, |state| state.1 < many);
        let (state, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
        assert!(!timeout.timed_out(), "nobody came to {:?}", state.0);
    }
}
