//! An actuator's state, which only one thread at a time may enter. Its code must not wait for itself, not even through another actuator
//! or through the disarming of a robot: see [`waits_for`].

use crate::control::{Awaited, InActuator, is_in_actuator, waits_for};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

/// See the [module](self). Its address identifies the actuator, so it must not be moved while it is used.
pub(super) struct Guarded<S> {
    /// The robot, whose disarming waits for the actuator's code.
    robot: Awaited,
    path: &'static str,
    state: Mutex<S>,
}

/// Keeps the calling thread inside an actuator until dropped.
pub(super) struct Held<'a, S> {
    // Declared before the lock: the thread leaves before the lock is released.
    _inside: InActuator,
    state: MutexGuard<'a, S>,
}

impl<S> Guarded<S> {
    pub(super) fn new(robot: Awaited, path: &'static str, state: S) -> Self {
        Self { robot, path, state: Mutex::new(state) }
    }

    /// Waits until no other thread is inside. Returns `None` if the calling thread would wait for its own code.
    pub(super) fn enter(&self) -> Option<Held<'_, S>> {
        if is_in_actuator(self.address()) {
            return None;
        }
        let state = match self.state.try_lock() {
            Ok(state) => state,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => {
                let _waits = waits_for(self.address())?;
                self.state.lock().unwrap_or_else(PoisonError::into_inner)
            }
        };
        Some(self.held(state))
    }

    /// As [`Self::enter`], without waiting.
    pub(super) fn try_enter(&self) -> Option<Held<'_, S>> {
        match self.state.try_lock() {
            Ok(state) => Some(self.held(state)),
            Err(TryLockError::Poisoned(poisoned)) => Some(self.held(poisoned.into_inner())),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    fn held<'a>(&self, state: MutexGuard<'a, S>) -> Held<'a, S> {
        Held { _inside: InActuator::new(self.robot, self.address(), self.path), state }
    }

    fn address(&self) -> Awaited {
        std::ptr::from_ref(&self.state).addr()
    }
}

impl<S> std::ops::Deref for Held<'_, S> {
    type Target = S;
    fn deref(&self) -> &S {
        &self.state
    }
}

impl<S> std::ops::DerefMut for Held<'_, S> {
    fn deref_mut(&mut self) -> &mut S {
        &mut self.state
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;

    /// Each thread enters one of the actuators and then, while the others are inside theirs, the next one. Returns how many threads
    /// got an error because they would wait for themselves.
    fn circle(guarded: &[Guarded<()>]) -> usize {
        let barrier = Barrier::new(guarded.len());
        std::thread::scope(|scope| {
            let threads: Vec<_> = (0..guarded.len())
                .map(|number| {
                    let barrier = &barrier;
                    scope.spawn(move || {
                        let _held = guarded[number].enter().expect("nobody waits yet");
                        barrier.wait();
                        guarded[(number + 1) % guarded.len()].enter().is_none()
                    })
                })
                .collect();
            threads.into_iter().filter_map(|thread| thread.join().ok()).filter(|is_refused| *is_refused).count()
        })
    }

    #[test]
    fn one_of_a_circle_is_told_and_the_others_go_on() {
        for size in 1..6 {
            let guarded: Vec<_> = std::iter::repeat_with(|| Guarded::new(0, "actuator", ())).take(size).collect();
            for _ in 0..200 {
                assert_eq!(circle(&guarded), 1, "of {size}");
            }
        }
    }

    #[test]
    fn whoever_waits_in_the_same_order_is_never_refused() {
        let guarded: Vec<_> = std::iter::repeat_with(|| Guarded::new(0, "actuator", 0)).take(4).collect();
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let guarded = &guarded;
                scope.spawn(move || {
                    for round in 0..2_000 {
                        let first = (thread + round) % 3;
                        let mut outer = guarded[first].enter().expect("no circle");
                        let mut inner = guarded[first + 1].enter().expect("no circle");
                        *outer += 1;
                        *inner += 1;
                    }
                });
            }
        });
        let sum: i32 = guarded.iter().map(|one| *one.enter().expect("free")).sum();
        assert_eq!(sum, 2 * 4 * 2_000);
    }
}
