//! A type-erased island: the interface used by the runtime.

use super::{CallError, IslandState, Key, NodeEntry};
use crate::declaration::IslandDeclaration;
use crate::journal::Event;
use crate::node::act::Visit;
use crate::pubsub::DynamicMessage;
use crate::time::MonotonicTime;
use std::sync::Arc;

#[cfg(not(loom))]
use super::{Island, IslandWiring, RELAXED, inbox::Pending, processing::for_all};
#[cfg(not(loom))]
use crate::fault::is_inside;
#[cfg(not(loom))]
use crate::node::act::Act;
#[cfg(not(loom))]
use std::{
    sync::PoisonError,
    sync::atomic::{Ordering, fence},
    time::Duration,
};

/// The interface of an island with its wiring, for a run, which knows no type of the robot.
pub trait AnyIsland: Send + Sync {
    /// The island as declared.
    fn declaration(&self) -> IslandDeclaration;
    /// Does any work that is due.
    fn wake(&self, now: MonotonicTime);
    /// Adds an entry for an estimator.
    fn post(&self, now: MonotonicTime, estimator: usize, entry: NodeEntry);
    /// Makes its estimators start.
    fn start(&self, now: MonotonicTime);
    /// Makes its estimators stop before any other waiting entry is processed.
    fn retire(&self, now: MonotonicTime);
    /// Processes waiting entries, unless another thread does.
    fn drain(&self);
    /// Marks the island as served by a worker, see [`Self::serve`].
    fn give_to_worker(&self);
    /// Processes entries on the calling thread until its estimators have stopped.
    fn serve(&self);
    /// Enters it as a caller: visits an estimator, publishes what that emits, and does what is due afterwards. With a journal,
    /// `line` is written first.
    fn visit(
        &self,
        now: MonotonicTime,
        estimator: usize,
        line: Event,
        visit: &mut Visit<'_>,
    ) -> Result<(), CallError>;
    /// The number of entries processed and the estimator whose callback ran last; `None` if no thread holds the island.
    fn busy(&self) -> Option<(u64, usize)>;
    /// The time of the last entry.
    fn entered_at(&self) -> MonotonicTime;
    /// Returns whether the calling thread is inside an island of this robot, and thus must not wait for one.
    fn is_inside(&self) -> bool;
    /// Returns whether the estimators of the island have stopped.
    fn has_retired(&self) -> bool;
    /// Returns whether the inbox is empty and no thread holds the island.
    fn is_idle(&self) -> bool;
    /// Restricts processing of entries to [`Self::replay`].
    fn begin_replay(&self);
    /// Processes the entry named by a journal; returns `false` if none matches.
    fn replay(&self, now: MonotonicTime, entry: Replayed<'_>) -> bool;
}

/// Makes the interface of an island from the wiring that it is in.
pub type IslandOf<W> = fn(&Arc<W>) -> Box<dyn AnyIsland>;

/// An island in its wiring.
#[allow(missing_debug_implementations)]
pub struct Placed<S: IslandState>(pub(super) Arc<S::Wiring>);

#[cfg(not(loom))]
impl<S: IslandState> Placed<S> {
    fn parts(&self) -> (&Island<S>, &S::Wiring) {
        (S::find(&self.0), &self.0)
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
impl<S: IslandState> AnyIsland for Placed<S>
where
    S::Wiring: Send + Sync,
{
    fn declaration(&self) -> IslandDeclaration {
        S::DECLARATION
    }

    fn wake(&self, now: MonotonicTime) {
        let (island, wiring) = self.parts();
        island.post_with(wiring, |inbox| inbox.wake(now));
    }

    fn post(&self, now: MonotonicTime, estimator: usize, entry: NodeEntry) {
        let (island, wiring) = self.parts();
        island.post_with(wiring, |inbox| inbox.post(now, estimator, entry));
    }

    fn start(&self, now: MonotonicTime) {
        let (island, wiring) = self.parts();
        island.post_with(wiring, |inbox| inbox.start(now));
    }

    fn retire(&self, now: MonotonicTime) {
        let (island, wiring) = self.parts();
        island.post_with(wiring, |inbox| inbox.retire(now));
    }

    fn drain(&self) {
        let (island, wiring) = self.parts();
        if !island.served.load(Ordering::Relaxed) {
            island.drain(wiring);
        }
    }

    fn give_to_worker(&self) {
        let (island, _) = self.parts();
        island.inbox().reserve();
        island.served.store(true, Ordering::SeqCst);
    }

    fn serve(&self) {
        let (island, wiring) = self.parts();
        loop {
            let mut inbox = island.inbox();
            while inbox.pending() == Pending::NOTHING {
                inbox = island.arrived.wait(inbox).unwrap_or_else(PoisonError::into_inner);
            }
            let is_last = inbox.retires();
            drop(inbox);
            // A caller may hold the island; it signals when it has finished.
            let Some(mut state) = island.hold(wiring, Duration::MAX) else { continue };
            while island.process_next(&mut state, wiring) && island.waiting.load(Ordering::Relaxed) == 0 {}
            drop(state);
            if is_last {
                break;
            }
            if island.waiting.load(Ordering::SeqCst) != 0 {
                island.tell_waiting();
                // A lock is not fair, and this thread would be faster than threads that must wake up first.
                island.wait(Duration::from_millis(1), || island.waiting.load(Ordering::Relaxed) == 0);
            }
        }
        island.served.store(false, Ordering::SeqCst);
        // A publisher that still saw the worker left its message to it: the fences ensure that one of the two sees the other.
        // Messages that arrived after the estimators had stopped are counted.
        fence(Ordering::SeqCst);
        island.drain(wiring);
    }

    fn visit(
        &self,
        now: MonotonicTime,
        estimator: usize,
        line: Event,
        visit: &mut Visit<'_>,
    ) -> Result<(), CallError> {
        let (island, wiring) = self.parts();
        island.call(wiring, now, line, |state, turn| {
            state.act(wiring, estimator, Act::Visit(visit, turn));
        })
    }

    fn busy(&self) -> Option<(u64, usize)> {
        let (island, wiring) = self.parts();
        island.is_held(wiring).then(|| (island.turns.load(RELAXED), island.running.load(RELAXED) as usize))
    }

    fn entered_at(&self) -> MonotonicTime {
        let (island, _) = self.parts();
        MonotonicTime::from_nanos(island.entered_nanos.load(RELAXED))
    }

    fn is_inside(&self) -> bool {
        let wiring = &*self.0;
        is_inside(wiring.environment().place())
    }

    fn has_retired(&self) -> bool {
        let (island, _) = self.parts();
        island.has_retired.load(Ordering::SeqCst)
    }

    fn is_idle(&self) -> bool {
        let (island, wiring) = self.parts();
        // The order matters: a thread holds the island before it takes the last entry.
        island.pending.load(Ordering::SeqCst) == 0 && !island.is_held(wiring)
    }

    fn begin_replay(&self) {
        let (island, wiring) = self.parts();
        island.replayed.store(true, Ordering::Relaxed);
        // This keeps publishers from entering directly.
        island.pending.store(usize::MAX, Ordering::Relaxed);
        if let Some(mut state) = island.try_hold(wiring) {
            state.begin_replay(wiring);
        }
    }

    fn replay(&self, now: MonotonicTime, entry: Replayed<'_>) -> bool {
        let (island, wiring) = self.parts();
        let message = match &entry {
            Replayed::Deliver(key) | Replayed::Drop(key) => {
                match island.inbox().take_message(|waiting| waiting.key == *key) {
                    Some(keyed) => Some(keyed),
                    None => return false,
                }
            }
            _ => None,
        };
        let Some(mut state) = island.try_hold(wiring) else { return false };
        let is_known = island.process_line(wiring, now, None, |turn| {
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
                    island.has_retired.store(true, Ordering::SeqCst);
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
