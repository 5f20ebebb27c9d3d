//! An actuator's state, which only one thread at a time may enter. Its code must not wait for itself: on the thread that runs it, an
//! attempt to enter once more is refused. Code of several actuators that wait for each other on several threads hangs.

use crate::fault::{Place, Within, is_inside, lock};
use std::sync::{Mutex, MutexGuard, TryLockError};

/// Lock around an actuator's state, see the [module](self). Its address identifies the actuator, so it must not be moved while it is used.
pub(super) struct Guarded<S> {
    /// The robot, whose disarming waits for the actuator's code.
    robot: usize,
    state: Mutex<S>,
}

/// The state of an actuator that the calling thread is inside of.
pub(super) type Held<'a, S> = Within<MutexGuard<'a, S>>;

impl<S> Guarded<S> {
    pub(super) fn new(robot: usize, state: S) -> Self {
        Self { robot, state: Mutex::new(state) }
    }

    /// Waits until no other thread is inside. Returns `None` if the calling thread would wait for its own code.
    pub(super) fn enter(&self) -> Option<Held<'_, S>> {
        if is_inside(self.place()) {
            return None;
        }
        Some(self.held(lock(&self.state)))
    }

    /// Enters as [`Self::enter`] does, without waiting.
    pub(super) fn try_enter(&self) -> Option<Held<'_, S>> {
        match self.state.try_lock() {
            Ok(state) => Some(self.held(state)),
            Err(TryLockError::Poisoned(poisoned)) => Some(self.held(poisoned.into_inner())),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    fn held<'a>(&self, state: MutexGuard<'a, S>) -> Held<'a, S> {
        Within::new(state, self.place())
    }

    fn place(&self) -> Place {
        Place::Actuator { robot: self.robot, actuator: std::ptr::from_ref(&self.state).addr() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_that_would_wait_for_itself_is_refused() {
        let (one, other) = (Guarded::new(0, 1), Guarded::new(0, 2));
        let held = one.enter().expect("nobody is inside");
        assert!(one.enter().is_none() && one.try_enter().is_none());
        assert_eq!(*other.enter().expect("another one"), 2);
        assert!(std::thread::scope(|scope| scope.spawn(|| one.try_enter().is_none()).join().expect("no panic")));
        drop(held);
        assert_eq!(*one.enter().expect("nobody is inside any more"), 1);
    }
}
