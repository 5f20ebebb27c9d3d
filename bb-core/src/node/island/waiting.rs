//! Threads that wait for an island: callers, and publishers that wait for room in its inbox.

use super::{Held, Island, IslandState, IslandWiring as _};
use crate::fault::is_inside;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Time for which a publisher waits for room in a full inbox before it concludes that the holder hangs.
const LONGEST_WAIT: Duration = Duration::from_millis(500);

impl<S: IslandState> Island<S> {
    /// Back-pressure: waits until the holder drains the inbox. Returns `false` at once if the holder hangs or if this thread
    /// is inside an island of this robot. `bytes` are those of the message that is to be added.
    pub(super) fn wait_for_room(&self, wiring: &S::Wiring, bytes: usize) -> bool {
        if self.hangs.load(Ordering::Relaxed) || is_inside(wiring.environment().place()) {
            return false;
        }
        self.waiting.fetch_add(1, Ordering::SeqCst);
        let in_time = self.wait(LONGEST_WAIT, || self.inbox().has_room(bytes) || self.is_free());
        if !in_time {
            self.hangs.store(true, Ordering::Relaxed);
        }
        // This must precede this thread's check of the inbox: see `drain`.
        self.waiting.fetch_sub(1, Ordering::SeqCst);
        in_time
    }

    /// Waits until `holds` returns true, for at most `longest`; returns whether it did.
    #[cfg(not(loom))]
    pub(super) fn wait(&self, longest: Duration, holds: impl Fn() -> bool) -> bool {
        // A change just before this thread began to wait is not signalled: this bounds the time until it is noticed.
        const STEP: Duration = Duration::from_millis(1);
        let start = std::time::Instant::now();
        loop {
            if holds() {
                return true;
            }
            let Some(left) = longest.checked_sub(start.elapsed()).filter(|left| !left.is_zero()) else {
                return false;
            };
            let inbox = self.inbox();
            drop(self.moved.wait_timeout(inbox, left.min(STEP)));
        }
    }

    /// A model has no time: other threads proceed once.
    #[cfg(loom)]
    pub(super) fn wait(&self, _: Duration, holds: impl Fn() -> bool) -> bool {
        loom::thread::yield_now();
        holds()
    }

    pub(super) fn tell_waiting(&self) {
        if self.waiting.load(Ordering::SeqCst) != 0 {
            drop(self.inbox());
            self.moved.notify_all();
        }
    }

    pub(super) fn gives_way(&self, processed: usize) -> bool {
        processed >= S::CAPACITY && self.waiting.load(Ordering::Relaxed) != 0
    }

    /// Takes the island once it is free, waiting for at most `longest`.
    pub(super) fn hold(&self, wiring: &S::Wiring, longest: Duration) -> Option<Held<'_, S>> {
        if let Some(state) = self.try_hold(wiring) {
            return Some(state);
        }
        self.waiting.fetch_add(1, Ordering::SeqCst);
        let held = std::cell::Cell::new(None);
        self.wait(longest, || {
            held.set(self.try_hold(wiring));
            let is_held = held.take();
            let found = is_held.is_some();
            held.set(is_held);
            found
        });
        self.waiting.fetch_sub(1, Ordering::SeqCst);
        held.take()
    }
}
