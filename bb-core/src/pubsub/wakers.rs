//! Work left until no lock is held: waking tasks and dropping messages. Both run user code.

use crate::fault::{discard, wake};
use std::any::Any;
use std::mem::needs_drop;
use std::task::Waker;

/// Wakers to wake and messages to drop, collected while locks may be held. Call [`run`](Self::run) when none is held;
/// dropping it does the same. A panic in one of them is logged, and does not prevent the others from running.
#[derive(Default)]
pub(crate) struct Wakers {
    /// The first few need no allocation.
    first: [Option<Waker>; 4],
    more: Vec<Waker>,
    evicted: Vec<Box<dyn Any + Send>>,
    drops_at_once: bool,
}

impl Wakers {
    /// Creates the wakers of a publisher that holds no lock of its own: evicted messages are dropped immediately, without an allocation.
    pub(super) fn dropping_at_once() -> Self {
        let mut wakers = Self::default();
        wakers.drops_at_once = true;
        wakers
    }

    /// Adds a task to wake.
    pub(super) fn wake(&mut self, waker: Waker) {
        match self.first.iter_mut().find(|slot| slot.is_none()) {
            Some(slot) => *slot = Some(waker),
            None => self.more.push(waker),
        }
    }

    /// Adds a message to drop; a message whose drop runs no code is dropped immediately. No lock of this module may
    /// be held.
    #[inline]
    pub(super) fn discard<M: Send + 'static>(&mut self, message: M) {
        if self.drops_at_once || !needs_drop::<M>() {
            discard(message);
        } else {
            self.evicted.push(Box::new(message));
        }
    }

    /// Returns whether there is nothing to do.
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        // The slots are filled in order.
        self.first[0].is_none() && self.evicted.is_empty()
    }

    /// Wakes the tasks in the order in which their messages were enqueued, then drops the messages. Returns how many wakers
    /// panicked.
    #[inline]
    pub(crate) fn run(mut self) -> u64 {
        if self.is_empty() { 0 } else { self.run_all() }
    }

    fn run_all(&mut self) -> u64 {
        let wakers = self.first.iter_mut().filter_map(Option::take).chain(self.more.drain(..));
        let panicked = wakers.map(wake).filter(|is_awake| !is_awake).count() as u64;
        self.evicted.drain(..).for_each(discard);
        panicked
    }
}

impl Drop for Wakers {
    #[inline]
    fn drop(&mut self) {
        if !self.is_empty() {
            self.run_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::task::Wake;

    /// Counts its wakes and drops, and panics in each of them.
    struct Faulty(Arc<AtomicUsize>);

    impl Wake for Faulty {
        fn wake(self: Arc<Self>) {
            self.0.fetch_add(1, Ordering::SeqCst);
            panic!("in a waker");
        }
    }

    struct Evicted(Arc<AtomicUsize>);

    impl Drop for Evicted {
        fn drop(&mut self) {
            self.0.fetch_add(1, Ordering::SeqCst);
            panic!("in a message's drop");
        }
    }

    #[test]
    fn a_panic_keeps_no_other_from_being_woken_or_dropped() {
        let (woken, dropped) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(0)));
        let mut wakers = Wakers::default();
        assert!(wakers.is_empty());
        for _ in 0..7 {
            wakers.wake(Arc::new(Faulty(Arc::clone(&woken))).into());
            wakers.discard(Evicted(Arc::clone(&dropped)));
        }
        assert!(!wakers.is_empty());
        assert_eq!((woken.load(Ordering::SeqCst), dropped.load(Ordering::SeqCst)), (0, 0));
        assert_eq!(wakers.run(), 7);
        assert_eq!((woken.load(Ordering::SeqCst), dropped.load(Ordering::SeqCst)), (7, 7));
    }

    #[test]
    fn dropping_them_runs_them() {
        let woken = Arc::new(AtomicUsize::new(0));
        let mut wakers = Wakers::default();
        wakers.wake(Arc::new(Faulty(Arc::clone(&woken))).into());
        drop(wakers);
        assert_eq!(woken.load(Ordering::SeqCst), 1);
    }
}
