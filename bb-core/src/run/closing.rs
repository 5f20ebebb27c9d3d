//! Runs code of components while the robot stops, on threads that nothing else waits for.

use crate::control::Control;
use crate::fault::discard;
use crate::schedule::Lane;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Calls in progress, each on a thread of the pool; on virtual time on the caller's thread.
#[derive(Default)]
pub(super) struct Closing(Arc<Shared>);

#[derive(Default)]
struct Shared {
    /// The number and the path of each that has not returned.
    left: Mutex<Vec<(usize, &'static str)>>,
    changed: Condvar,
}

impl Closing {
    /// Runs code of the component at `path`; `run` returns whether it is done.
    pub(super) fn run(
        &mut self,
        control: &Control,
        path: &'static str,
        run: impl FnOnce() -> bool + Send + 'static,
    ) {
        let number = self.0.add(path);
        if control.is_virtual() {
            return self.0.returned(number, run());
        }
        let shared = Arc::clone(&self.0);
        control.pool().submit(Lane::Robot, move || shared.returned(number, run()));
    }

    /// Drops a value of the component at `path`.
    pub(super) fn discard(&mut self, control: &Control, path: &'static str, value: impl Send + 'static) {
        self.run(control, path, move || {
            discard(value);
            true
        });
    }

    /// Waits until all have returned; returns the paths of those that have not at `deadline`.
    pub(super) fn wait(self, deadline: Instant) -> Vec<&'static str> {
        let mut left = self.0.lock();
        while !left.is_empty() {
            let time = deadline.saturating_duration_since(Instant::now());
            if time.is_zero() {
                break;
            }
            left = self.0.changed.wait_timeout(left, time).unwrap_or_else(PoisonError::into_inner).0;
        }
        left.iter().map(|(_, path)| *path).collect()
    }
}

impl Shared {
    fn add(&self, path: &'static str) -> usize {
        let mut left = self.lock();
        let number = left.last().map_or(0, |(last, _)| last + 1);
        left.push((number, path));
        number
    }

    fn returned(&self, number: usize, is_done: bool) {
        if is_done {
            self.lock().retain(|(other, _)| *other != number);
            self.changed.notify_all();
        }
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(usize, &'static str)>> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
