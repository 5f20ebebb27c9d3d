//! Tracks which actuators the calling thread is inside and which one it waits for. Their code must not wait for itself, not even
//! through another actuator.
//!
//! A thread that is inside one actuator and finds another one taken registers its wait, under one lock. It then looks for a cycle:
//! whether the thread inside the other waits for an actuator whose thread waits for … an actuator that this thread is inside. Each
//! thread of such a cycle has entered its actuator before it registers its wait. The last thread to register therefore sees the
//! whole cycle and gets an error instead of waiting. Without a cycle, no thread gets an error.

use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

thread_local! {
    /// The addresses of the actuators.
    static HELD: RefCell<Vec<usize>> = const { RefCell::new(Vec::new()) };
    static THIS: u64 = NEXT.fetch_add(1, Ordering::Relaxed);
}

/// The number of the next thread to enter an actuator.
static NEXT: AtomicU64 = AtomicU64::new(NOBODY + 1);
const NOBODY: u64 = 0;

/// The actuators awaited by threads inside another actuator.
static WAITING: Mutex<Option<HashMap<u64, Awaited>>> = Mutex::new(None);

/// An awaited actuator, with the thread inside it. The pointer is not followed after the thread has stopped waiting.
type Awaited = std::sync::Arc<AtomicU64>;

/// An actuator's state, which only one thread at a time may enter.
pub(super) struct Guarded<S> {
    state: Mutex<S>,
    inside: Awaited,
}

/// Keeps the calling thread inside an actuator until dropped.
pub(super) struct Held<'a, S> {
    // Declared before the lock: the thread leaves before the lock is released.
    _left: Left<'a>,
    state: MutexGuard<'a, S>,
}

struct Left<'a>(&'a AtomicU64);

impl<S> Guarded<S> {
    pub(super) fn new(state: S) -> Self {
        Self { state: Mutex::new(state), inside: Awaited::default() }
    }

    /// Waits until no other thread is inside. Returns `None` if the calling thread would wait for its own code.
    pub(super) fn enter(&self) -> Option<Held<'_, S>> {
        let this = self.address();
        let (is_here, is_within) = HELD.with_borrow(|held| (held.contains(&this), !held.is_empty()));
        if is_here {
            return None;
        }
        let state = match self.state.try_lock() {
            Ok(state) => state,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) if is_within => self.wait_unless_in_a_circle()?,
            Err(TryLockError::WouldBlock) => self.state.lock().unwrap_or_else(PoisonError::into_inner),
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

    fn held<'a>(&'a self, state: MutexGuard<'a, S>) -> Held<'a, S> {
        self.inside.store(THIS.with(|this| *this), Ordering::SeqCst);
        HELD.with_borrow_mut(|held| held.push(self.address()));
        Held { _left: Left(&self.inside), state }
    }

    #[cold]
    fn wait_unless_in_a_circle(&self) -> Option<MutexGuard<'_, S>> {
        let this = THIS.with(|this| *this);
        {
            let mut waiting = WAITING.lock().unwrap_or_else(PoisonError::into_inner);
            let waiting = waiting.get_or_insert_default();
            let mut inside = self.inside.load(Ordering::SeqCst);
            // A thread that has just acquired the actuator it waited for is inside it.
            while let Some(awaited) = waiting.get(&inside).filter(|_| inside != this) {
                let next = awaited.load(Ordering::SeqCst);
                if next == inside {
                    break;
                }
                inside = next;
            }
            if inside == this {
                return None;
            }
            waiting.insert(this, Awaited::clone(&self.inside));
        }
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(waiting) = &mut *WAITING.lock().unwrap_or_else(PoisonError::into_inner) {
            waiting.remove(&this);
        }
        Some(state)
    }

    fn address(&self) -> usize {
        std::ptr::from_ref(&*self.inside).addr()
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

impl Drop for Left<'_> {
    fn drop(&mut self) {
        self.0.store(NOBODY, Ordering::SeqCst);
        let this = std::ptr::from_ref(self.0).addr();
        HELD.with_borrow_mut(|held| held.retain(|other| *other != this));
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
            let guarded: Vec<_> = std::iter::repeat_with(|| Guarded::new(())).take(size).collect();
            for _ in 0..200 {
                assert_eq!(circle(&guarded), 1, "of {size}");
            }
        }
    }

    #[test]
    fn whoever_waits_in_the_same_order_is_never_refused() {
        let guarded: Vec<_> = std::iter::repeat_with(|| Guarded::new(0)).take(4).collect();
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
        assert!(WAITING.lock().is_ok_and(|waiting| waiting.as_ref().is_none_or(|waiting| waiting.len() < 8)));
    }
}
