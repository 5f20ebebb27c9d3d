//! Admits messages from threads that the robot does not wait for.

#[cfg(loom)]
use loom::sync::atomic::AtomicUsize;
use std::sync::Arc;
#[cfg(not(loom))]
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Open from the start until the robot has stopped. Later messages are refused, so the last report counts exactly
/// what the journal holds. Clones share the same door.
#[derive(Clone, Debug)]
pub(crate) struct Door(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    /// Twice the number of threads inside, plus 1 once closed. One word, so an entering thread either is seen by the
    /// closing thread or finds the door closed.
    state: AtomicUsize,
    /// `true` if entries are counted: without a journal there is nothing to agree with.
    is_counted: bool,
}

const CLOSED: usize = 1;
const ONE_INSIDE: usize = 2;

/// Permit to be inside, until it is dropped.
#[derive(Debug)]
pub(crate) struct Inside<'a>(Option<&'a Shared>);

impl Door {
    pub(crate) fn new(is_counted: bool) -> Self {
        Self(Arc::new(Shared { state: AtomicUsize::new(0), is_counted }))
    }

    /// Lets the caller in, or returns `None` once the door is closed.
    #[inline]
    pub(crate) fn enter(&self) -> Option<Inside<'_>> {
        let shared = &*self.0;
        if !shared.is_counted {
            return (shared.state.load(Ordering::Relaxed) & CLOSED == 0).then_some(Inside(None));
        }
        let before = shared.state.fetch_add(ONE_INSIDE, Ordering::AcqRel);
        let inside = Inside(Some(shared));
        (before & CLOSED == 0).then_some(inside)
    }

    /// Closes the door and waits until `deadline` for threads still inside; returns `false` if some remain.
    pub(crate) fn close(&self, deadline: Instant) -> bool {
        self.0.state.fetch_or(CLOSED, Ordering::AcqRel);
        while self.0.state.load(Ordering::Acquire) >= ONE_INSIDE {
            if Instant::now() >= deadline {
                return false;
            }
            wait();
        }
        true
    }
}

impl Drop for Inside<'_> {
    #[inline]
    fn drop(&mut self) {
        if let Some(shared) = self.0 {
            shared.state.fetch_sub(ONE_INSIDE, Ordering::AcqRel);
        }
    }
}

#[cfg(not(loom))]
fn wait() {
    std::thread::sleep(std::time::Duration::from_micros(100));
}

#[cfg(loom)]
fn wait() {
    loom::thread::yield_now();
}

#[cfg(all(test, loom))]
mod model {
    use super::*;
    use std::time::Duration;

    #[test]
    fn nobody_is_inside_a_door_that_was_closed() {
        loom::model(|| {
            let door = Door::new(true);
            // Only those inside count; no ordering is needed.
            let written = loom::sync::Arc::new(AtomicUsize::new(0));
            let publishers = [0, 1].map(|_| {
                let (door, written) = (door.clone(), loom::sync::Arc::clone(&written));
                loom::thread::spawn(move || {
                    if let Some(_inside) = door.enter() {
                        written.fetch_add(1, Ordering::Relaxed);
                    }
                })
            });
            assert!(door.close(Instant::now() + Duration::from_secs(3600)));
            let at_the_end = written.load(Ordering::Relaxed);
            publishers.into_iter().for_each(|publisher| publisher.join().expect("it does not panic"));
            assert_eq!(at_the_end, written.load(Ordering::Relaxed));
        });
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn threads_inside_are_waited_for_and_none_enters_later() {
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
