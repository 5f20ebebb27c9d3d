//! A type-erased island: the interface used by the runtime.

use super::{CallError, Key, NodeEntry};
use crate::declaration::IslandDeclaration;
use crate::journal::Event;
use crate::node::act::Visit;
use crate::pubsub::DynamicMessage;
use crate::time::MonotonicTime;
use std::sync::Arc;

#[cfg(not(loom))]
use super::{Island, IslandState, IslandWiring, RELAXED, inbox::Pending, inside::is_inside, processing::for_all};
#[cfg(not(loom))]
use crate::node::act::Act;
#[cfg(not(loom))]
use std::{
    sync::PoisonError,
    sync::atomic::{Ordering, fence},
    time::Duration,
};

/// Finds an island in a wiring.
pub type IslandOf<W> = fn(&W) -> &dyn IslandIn<W>;

/// The common interface of all islands of a robot with the wiring `W`.
pub trait IslandIn<W> {
    /// The island as declared.
    fn declaration(&self) -> IslandDeclaration;
    /// Does any work that is due.
    fn wake(&self, wiring: &W, now: MonotonicTime);
    /// Adds an entry for an estimator.
    fn post(&self, wiring: &W, now: MonotonicTime, estimator: usize, entry: NodeEntry);
    /// Makes its estimators start.
    fn start(&self, wiring: &W, now: MonotonicTime);
    /// Makes its estimators stop before any other waiting entry is processed.
    fn retire(&self, wiring: &W, now: MonotonicTime);
    /// Processes waiting entries, unless another thread does.
    fn drain(&self, wiring: &W);
    /// Marks the island as served by a worker, see [`Self::serve`].
    fn give_to_worker(&self);
    /// Processes entries on the calling thread until its estimators have stopped.
    fn serve(&self, wiring: &W);
    /// Enters it as a caller: visits an estimator, publishes what that emits, and does what is due afterwards. With a journal,
    /// `line` is written first.
    fn visit(
        &self,
        wiring: &W,
        now: MonotonicTime,
        estimator: usize,
        line: Event,
        visit: &mut Visit<'_>,
    ) -> Result<(), CallError>;
    /// The number of entries processed and the estimator whose callback ran last; `None` if no thread holds the island.
    fn busy(&self, wiring: &W) -> Option<(u64, usize)>;
    /// The time of the last entry.
    fn entered_at(&self) -> MonotonicTime;
    /// Returns whether the calling thread is inside an island of this robot, and thus must not wait for one.
    fn is_inside(&self, wiring: &W) -> bool;
    /// Returns whether the estimators of the island have stopped.
    fn has_retired(&self) -> bool;
    /// Returns whether the inbox is empty and no thread holds the island.
    fn is_idle(&self, wiring: &W) -> bool;
    /// Restricts processing of entries to [`Self::replay`].
    fn begin_replay(&self, wiring: &W);
    /// Processes the entry named by a journal; returns `false` if none matches.
    fn replay(&self, wiring: &W, now: MonotonicTime, entry: Replayed<'_>) -> bool;
}

/// An island with its wiring: the interface used by a run, which knows no type of the robot. See [`IslandIn`] for its methods.
pub(crate) trait AnyIsland: Send + Sync {
    fn declaration(&self) -> IslandDeclaration;
    fn wake(&self, now: MonotonicTime);
    fn post(&self, now: MonotonicTime, estimator: usize, entry: NodeEntry);
    fn start(&self, now: MonotonicTime);
    fn retire(&self, now: MonotonicTime);
    fn drain(&self);
    fn give_to_worker(&self);
    fn serve(&self);
    fn visit(
        &self,
        now: MonotonicTime,
        estimator: usize,
        line: Event,
        visit: &mut Visit<'_>,
    ) -> Result<(), CallError>;
    fn busy(&self) -> Option<(u64, usize)>;
    fn entered_at(&self) -> MonotonicTime;
    fn is_inside(&self) -> bool;
    fn has_retired(&self) -> bool;
    fn is_idle(&self) -> bool;
    fn begin_replay(&self);
    fn replay(&self, now: MonotonicTime, entry: Replayed<'_>) -> bool;
}

/// The islands of a wiring, in the order of their numbers.
pub(crate) fn islands_in<W: Send + Sync + 'static>(
    wiring: &Arc<W>,
    islands: &'static [IslandOf<W>],
) -> Box<[Box<dyn AnyIsland>]> {
    let place = |find: &IslandOf<W>| -> Box<dyn AnyIsland> { Box::new(Placed(Arc::clone(wiring), *find)) };
    islands.iter().map(place).collect()
}

/// A wiring, and where an island is in it.
struct Placed<W>(Arc<W>, IslandOf<W>);

impl<W: Send + Sync> AnyIsland for Placed<W> {
    fn declaration(&self) -> IslandDeclaration {
        (self.1)(&self.0).declaration()
    }

    fn wake(&self, now: MonotonicTime) {
        (self.1)(&self.0).wake(&self.0, now);
    }

    fn post(&self, now: MonotonicTime, estimator: usize, entry: NodeEntry) {
        (self.1)(&self.0).post(&self.0, now, estimator, entry);
    }

    fn start(&self, now: MonotonicTime) {
        (self.1)(&self.0).start(&self.0, now);
    }

    fn retire(&self, now: MonotonicTime) {
        (self.1)(&self.0).retire(&self.0, now);
    }

    fn drain(&self) {
        (self.1)(&self.0).drain(&self.0);
    }

    fn give_to_worker(&self) {
        (self.1)(&self.0).give_to_worker();
    }

    fn serve(&self) {
        (self.1)(&self.0).serve(&self.0);
    }

    fn visit(
        &self,
        now: MonotonicTime,
        estimator: usize,
        line: Event,
        visit: &mut Visit<'_>,
    ) -> Result<(), CallError> {
        (self.1)(&self.0).visit(&self.0, now, estimator, line, visit)
    }

    fn busy(&self) -> Option<(u64, usize)> {
        (self.1)(&self.0).busy(&self.0)
    }

    fn entered_at(&self) -> MonotonicTime {
        (self.1)(&self.0).entered_at()
    }

    fn is_inside(&self) -> bool {
        (self.1)(&self.0).is_inside(&self.0)
    }

    fn has_retired(&self) -> bool {
        (self.1)(&self.0).has_retired()
    }

    fn is_idle(&self) -> bool {
        (self.1)(&self.0).is_idle(&self.0)
    }

    fn begin_replay(&self) {
        (self.1)(&self.0).begin_replay(&self.0);
    }

    fn replay(&self, now: MonotonicTime, entry: Replayed<'_>) -> bool {
        (self.1)(&self.0).replay(&self.0, now, entry)
    }
}

/// An entry of an island in a journal.
#[derive(Debug)]
pub enum Replayed<'a> {
    /// Deliver the first message with that key.
    Deliver(Key),
    /// Drop the first message with that key.
    Drop(Key),
    /// Something was due.
    Wake,
    /// The estimators start.
    Start,
    /// The estimators stop.
    Retire,
    /// An entry for an estimator.
    Node(usize, NodeEntry),
    /// The output that an estimator emitted in reply to a request missing from the journal.
    Emission(&'a DynamicMessage),
}

#[cfg(not(loom))]
impl<S: IslandState> IslandIn<S::Wiring> for Island<S> {
    fn declaration(&self) -> IslandDeclaration {
        S::DECLARATION
    }

    fn wake(&self, wiring: &S::Wiring, now: MonotonicTime) {
        self.post_with(wiring, |inbox| inbox.wake(now));
    }

    fn post(&self, wiring: &S::Wiring, now: MonotonicTime, estimator: usize, entry: NodeEntry) {
        self.post_with(wiring, |inbox| inbox.post(now, estimator, entry));
    }

    fn start(&self, wiring: &S::Wiring, now: MonotonicTime) {
        self.post_with(wiring, |inbox| inbox.start(now));
    }

    fn retire(&self, wiring: &S::Wiring, now: MonotonicTime) {
        self.post_with(wiring, |inbox| inbox.retire(now));
    }

    fn drain(&self, wiring: &S::Wiring) {
        if !self.served.load(Ordering::Relaxed) {
            Self::drain(self, wiring);
        }
    }

    fn give_to_worker(&self) {
        self.inbox().reserve();
        self.served.store(true, Ordering::SeqCst);
    }

    fn serve(&self, wiring: &S::Wiring) {
        loop {
            let mut inbox = self.inbox();
            while inbox.pending() == Pending::NOTHING {
                inbox = self.arrived.wait(inbox).unwrap_or_else(PoisonError::into_inner);
            }
            let is_last = inbox.retires();
            drop(inbox);
            // A caller may hold the island; it signals when it has finished.
            let Some(mut state) = self.hold(wiring, Duration::MAX) else { continue };
            while self.process_next(&mut state, wiring) && self.waiting.load(Ordering::Relaxed) == 0 {}
            drop(state);
            if is_last {
                break;
            }
            if self.waiting.load(Ordering::SeqCst) != 0 {
                self.tell_waiting();
                // A lock is not fair, and this thread would be faster than threads that must wake up first.
                self.wait(Duration::from_millis(1), || self.waiting.load(Ordering::Relaxed) == 0);
            }
        }
        self.served.store(false, Ordering::SeqCst);
        // A publisher that still saw the worker left its message to it: the fences ensure that one of the two sees the other.
        // Messages that arrived after the estimators had stopped are counted.
        fence(Ordering::SeqCst);
        Self::drain(self, wiring);
    }

    fn visit(
        &self,
        wiring: &S::Wiring,
        now: MonotonicTime,
        estimator: usize,
        line: Event,
        visit: &mut Visit<'_>,
    ) -> Result<(), CallError> {
        self.call(wiring, now, line, |state, turn| {
            state.act(wiring, estimator, Act::Visit(visit, turn));
        })
    }

    fn busy(&self, wiring: &S::Wiring) -> Option<(u64, usize)> {
        self.is_held(wiring).then(|| (self.turns.load(RELAXED), self.running.load(RELAXED) as usize))
    }

    fn entered_at(&self) -> MonotonicTime {
        MonotonicTime::from_nanos(self.entered_nanos.load(RELAXED))
    }

    fn is_inside(&self, wiring: &S::Wiring) -> bool {
        is_inside(wiring.environment().robot())
    }

    fn has_retired(&self) -> bool {
        self.has_retired.load(Ordering::SeqCst)
    }

    fn is_idle(&self, wiring: &S::Wiring) -> bool {
        // The order matters: a thread holds the island before it takes the last entry.
        self.pending.load(Ordering::SeqCst) == 0 && !self.is_held(wiring)
    }

    fn begin_replay(&self, wiring: &S::Wiring) {
        self.replayed.store(true, Ordering::Relaxed);
        // This keeps publishers from entering directly.
        self.pending.store(usize::MAX, Ordering::Relaxed);
        if let Some(mut state) = self.try_hold(wiring) {
            state.begin_replay(wiring);
        }
    }

    fn replay(&self, wiring: &S::Wiring, now: MonotonicTime, entry: Replayed<'_>) -> bool {
        let message = match &entry {
            Replayed::Deliver(key) | Replayed::Drop(key) => {
                match self.inbox().take_message(|waiting| waiting.key == *key) {
                    Some(keyed) => Some(keyed),
                    None => return false,
                }
            }
            _ => None,
        };
        let Some(mut state) = self.try_hold(wiring) else { return false };
        let is_known = self.process_line(wiring, now, None, |turn| {
            match entry {
                Replayed::Deliver(_) => {
                    let Some(keyed) = &message else { return false };
                    state.deliver(wiring, &keyed.message, turn);
                }
                Replayed::Drop(key) => S::dropped(wiring, key),
                Replayed::Wake => state.wake(wiring, turn),
                Replayed::Start => for_all(&mut *state, wiring, turn, || NodeEntry::Start),
                Replayed::Retire => {
                    for_all(&mut *state, wiring, turn, || NodeEntry::Retire);
                    self.has_retired.store(true, Ordering::SeqCst);
                }
                Replayed::Node(estimator, entry) => state.handle(wiring, estimator, entry, turn),
                Replayed::Emission(message) => return state.emit(wiring, message, turn),
            }
            true
        });
        crate::fault::discard(message);
        is_known
    }
}
