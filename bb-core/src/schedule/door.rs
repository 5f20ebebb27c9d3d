//! Through which messages come in from threads that the robot does not wait for.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Open from the start until the robot has stopped: what is published later is not taken, so that the last report counts what
/// the journal holds, neither more nor less. Clones are the same door.
#[derive(Clone, Debug)]
pub(crate) struct Door(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    is_closed: AtomicBool,
    inside: AtomicUsize,
    /// Without a journal nothing has to agree with it, and nobody is counted.
    is_counted: bool,
}

/// Somebody is inside as long as this lives.
#[derive(Debug)]
pub(crate) struct Inside<'a>(Option<&'a Shared>);

impl Door {
    pub(crate) fn new(is_counted: bool) -> Self {
        Self(Arc::new(Shared { is_closed: AtomicBool::new(false), inside: AtomicUsize::new(0), is_counted }))
    }

    /// Lets the caller in; none once the door is closed.
    #[inline]
    pub(crate) fn enter(&self) -> Option<Inside<'_>> {
        let shared = &*self.0;
        if !shared.is_counted {
            return (!shared.is_closed.load(Ordering::Relaxed)).then_some(Inside(None));
        }
        // Whoever closes it sees this one inside, or this one sees it closed.
        shared.inside.fetch_add(1, Ordering::SeqCst);
        let inside = Inside(Some(shared));
        (!shared.is_closed.load(Ordering::SeqCst)).then_some(inside)
    }

    /// Lets nobody in any more, and waits until `deadline` for those who are inside; false if some are still.
    pub(crate) fn close(&self, deadline: Instant) -> bool {
        self.0.is_closed.store(true, Ordering::SeqCst);
        while self.0.inside.load(Ordering::SeqCst) != 0 {
            if Instant::now() >= deadline {
                return false;
            }
            std::thread::sleep(Duration::from_micros(100));
        }
        true
    }
}

impl Drop for Inside<'_> {
    #[inline]
    fn drop(&mut self) {
        if let Some(shared) = self.0 {
            shared.inside.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_was_let_in_is_waited_for_and_nobody_comes_in_later() {
        for _ in 0..200 {
            let (door, written) = (Door::new(true), AtomicUsize::new(0));
            let at_the_end = std::thread::scope(|scope| {
                for _ in 0..3 {
                    scope.spawn(|| {
                        while let Some(_inside) = door.enter() {
                            written.fetch_add(1, Ordering::Relaxed);
                        }
                    });
                }
                while written.load(Ordering::Relaxed) < 10 {
                    std::thread::yield_now();
                }
                assert!(door.close(Instant::now() + Duration::from_secs(10)));
                written.load(Ordering::SeqCst)
            });
            assert_eq!(at_the_end, written.into_inner());
        }
    }

    #[test]
    fn one_who_stays_is_left_behind() {
        let door = Door::new(true);
        let _inside = door.enter();
        assert!(!door.close(Instant::now() + Duration::from_millis(1)));
        assert!(door.enter().is_none());
    }
}
