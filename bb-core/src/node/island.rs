//! Estimators that always run together, with one ordered queue in front of them.
//!
//! The estimators that a message reaches are known at compile time, so `robot!` cuts the dataflow into islands. An estimator
//! fed by only one sensor, directly or through others, belongs to that sensor's island. One fed by several sensors, or declared
//! `runs_on: worker`, begins its own island. Inside an island a message passes from estimator to estimator by plain calls on
//! plain fields, without a lock, an atomic or a queue.
//!
//! Everything that reaches an island enters here: messages, timers, options, requests, restarts, losses and the stop. A
//! publisher that finds the island free and no entry waiting runs everything downstream. Otherwise the entry waits in the
//! inbox until the thread that holds the island processes it before leaving. There is thus a single writer, and all entries
//! are totally ordered.
//!
//! No thread blocks on the island's own lock; threads only ever try it. A thread that needs a held island (a caller waiting for
//! an answer, a publisher waiting for room) waits on a condition variable with a timeout. An estimator that hangs therefore
//! blocks no other thread forever.

mod alone;
mod any;
mod inbox;
mod member;
#[cfg(all(test, loom))]
mod model;
mod processing;
mod waiting;

pub use self::alone::{Alone, Inlet, Solo, enter_alone, publish_to, start_alone};
pub use self::any::IslandOf;
use self::any::Placed;
pub(crate) use self::any::{AnyIsland, Replayed};
use self::inbox::Inbox;
pub use self::member::{Member, act, alone, emit, enter, hold, island, receive, start};
use self::processing::{deliver, dropped};
use super::act::Act;
use super::environment::Environment;
use super::{NodeEntry, Turn};
use crate::declaration::{EstimatorDeclaration, IslandDeclaration};
use crate::fault::{Within, is_inside};
use crate::journal::Event;
use crate::pubsub::DynamicMessage;
use crate::time::MonotonicTime;
use std::fmt;
use std::time::Duration;

#[cfg(loom)]
use loom::sync::{
    Condvar, Mutex, MutexGuard,
    atomic::{AtomicBool, AtomicUsize, Ordering, fence},
};
use std::sync::atomic::{AtomicI64, AtomicU32, AtomicU64};
#[cfg(not(loom))]
use std::sync::{
    Condvar, Mutex, MutexGuard,
    atomic::{AtomicBool, AtomicUsize, Ordering, fence},
};
use std::sync::{PoisonError, TryLockError};

/// Implemented by `robot!` for its wiring.
pub trait IslandWiring {
    /// The estimators as declared.
    const ESTIMATORS: &'static [EstimatorDeclaration];

    /// State shared by all islands.
    fn environment(&self) -> &Environment;
}

/// Implemented by `robot!` for each island. `Send` is required of the whole wiring; as a bound here it would be proven again
/// wherever an island is named.
pub trait IslandState: Sized {
    /// The robot's wiring.
    type Wiring: IslandWiring;
    /// The messages that may wait in the inbox, with one variant for each outside publisher that feeds the island.
    type Message;
    /// The number of messages that the inbox holds.
    const CAPACITY: usize = 1024;
    /// The island as declared.
    const DECLARATION: IslandDeclaration;

    /// Finds the island in the wiring.
    fn find(wiring: &Self::Wiring) -> &Island<Self>;
    /// Runs everything downstream of a message.
    fn deliver(&mut self, wiring: &Self::Wiring, message: &Self::Message, turn: &Turn<'_>);
    /// Performs an act on the estimator with that number; returns `false` if it cannot.
    fn act(&mut self, wiring: &Self::Wiring, estimator: usize, act: Act<'_, '_>) -> bool;

    /// Does all that is due: timers, ticks, restarts.
    fn wake(&mut self, wiring: &Self::Wiring, turn: &Turn<'_>) {
        for estimator in Self::DECLARATION.estimators {
            self.act(wiring, *estimator, Act::Turn(turn));
        }
    }

    /// Hands an entry to the estimator with that number.
    fn handle(&mut self, wiring: &Self::Wiring, estimator: usize, entry: NodeEntry, turn: &Turn<'_>) {
        self.act(wiring, estimator, Act::Handle(entry, turn));
    }

    /// Creates the estimators of the island, in a replay.
    fn begin_replay(&mut self, wiring: &Self::Wiring) {
        for estimator in Self::DECLARATION.estimators {
            self.act(wiring, *estimator, Act::BeginReplay);
        }
    }

    /// Publishes the output that an estimator emitted in reply to a request missing from the journal, in a replay. Returns `false` if
    /// no estimator of this island has such a publisher.
    fn emit(&mut self, wiring: &Self::Wiring, message: &DynamicMessage, turn: &Turn<'_>) -> bool {
        Self::DECLARATION.estimators.iter().any(|estimator| self.act(wiring, *estimator, Act::Emit(message, turn)))
    }

    /// Counts a message that did not fit in the inbox, for each estimator it would have reached.
    fn dropped(wiring: &Self::Wiring, key: Key) {
        let inlets = Self::DECLARATION.inlets.iter().filter(|inlet| inlet.entry == key.entry);
        for (estimator, input) in inlets.flat_map(|inlet| inlet.inputs) {
            wiring.environment().overflow(*estimator, *input);
        }
    }
}

/// Time for which a caller waits for an island.
const LONGEST_CALL: Duration = Duration::from_secs(5);

/// The ordering for values that are not part of the model.
const RELAXED: std::sync::atomic::Ordering = std::sync::atomic::Ordering::Relaxed;

/// An island and the inbox in front of it.
pub struct Island<S: IslandState> {
    state: Mutex<S>,
    inbox: Mutex<Inbox<Keyed<S::Message>>>,
    /// The contents of the inbox as one word, which the holder checks before it leaves.
    pending: AtomicUsize,
    /// Callers that wait for the island, and publishers that wait for room in its inbox.
    waiting: AtomicUsize,
    /// `true` if a publisher has waited for room in vain. The holder is considered hung until it takes the next entry.
    hangs: AtomicBool,
    /// Signals to the worker that an entry has been added.
    arrived: Condvar,
    /// Signals to waiting threads that an entry was taken or that the island is free.
    moved: Condvar,
    /// `true` if a worker serves the island.
    served: AtomicBool,
    /// `true` if a journal determines when entries are processed.
    replayed: AtomicBool,
    /// Number of entries processed, used to report an island that hangs.
    turns: AtomicU64,
    /// The estimator whose callback ran last.
    running: AtomicU32,
    /// The time of the last entry.
    entered_nanos: AtomicI64,
    /// `true` once the estimators of the island have stopped.
    has_retired: AtomicBool,
}

/// The key of a message: its publisher and its line number in the journal, if there is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// The publisher, as the island numbers them.
    pub entry: usize,
    /// The line number; 0 without a line.
    pub line: u64,
}

/// A waiting message.
struct Keyed<M> {
    key: Key,
    message: M,
}

/// Reason for which a call was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallError {
    /// The calling thread is inside an island of the same robot and would wait for itself.
    Inside,
    /// Another thread has held the island for too long.
    Busy,
}

/// Result of a check whether an island is held.
struct Check {
    is_held: bool,
    /// `true` if an entry is waiting that another thread may have left because of this check.
    has_kept: bool,
}

type Held<'a, S> = Within<MutexGuard<'a, S>>;

impl<S: IslandState> Island<S> {
    /// Creates an island that is not running yet.
    pub fn new(state: S) -> Self {
        Self {
            state: Mutex::new(state),
            inbox: Mutex::new(Inbox::new(S::CAPACITY)),
            pending: AtomicUsize::new(0),
            waiting: AtomicUsize::new(0),
            hangs: AtomicBool::new(false),
            arrived: Condvar::new(),
            moved: Condvar::new(),
            served: AtomicBool::new(false),
            replayed: AtomicBool::new(false),
            turns: AtomicU64::new(0),
            running: AtomicU32::new(u32::MAX),
            entered_nanos: AtomicI64::new(0),
            has_retired: AtomicBool::new(false),
        }
    }

    /// Runs `direct` if the island is free and no entry is waiting; otherwise leaves `message`, with its counted bytes, in the
    /// inbox.
    #[inline]
    pub fn enter(
        &self,
        wiring: &S::Wiring,
        now: MonotonicTime,
        key: Key,
        direct: impl FnOnce(&mut S, &Turn<'_>),
        message: impl FnOnce() -> (S::Message, usize),
    ) {
        if self.pending.load(Ordering::Relaxed) == 0
            && !self.served.load(Ordering::Relaxed)
            && let Some(mut state) = self.try_hold(wiring)
        {
            self.process(wiring, now, || deliver::<S>(key), |turn| direct(&mut state, turn));
            return self.leave(wiring, state);
        }
        let (message, bytes) = message();
        self.enqueue(wiring, now, Keyed { key, message }, bytes);
    }

    /// Puts a message into the inbox and ensures that a thread processes it.
    #[cold]
    fn enqueue(&self, wiring: &S::Wiring, now: MonotonicTime, message: Keyed<S::Message>, bytes: usize) {
        let mut inbox = self.inbox();
        // Allocated only once, when the first message has to wait.
        inbox.reserve();
        if self.replayed.load(Ordering::Relaxed) {
            return inbox.push(now, message, bytes);
        }
        while !inbox.has_room(bytes) && !self.served.load(Ordering::Relaxed) {
            drop(inbox);
            let may_have_room = self.wait_for_room(wiring, bytes);
            self.attend(wiring);
            inbox = self.inbox();
            // Otherwise another publisher may have taken the last slot.
            if !may_have_room {
                break;
            }
        }
        // A large message takes the room of several.
        let mut dropped = Vec::new();
        while !inbox.has_room(bytes)
            && let Some(oldest) = inbox.pop_message()
        {
            if let Some(journal) = wiring.environment().journal() {
                let offset = wiring.environment().clock().wall_offset_nanos();
                journal.write(now, offset, self::dropped::<S>(oldest.key));
            }
            dropped.push(oldest);
        }
        inbox.push(now, message, bytes);
        self.pending.store(inbox.pending().0, Ordering::Relaxed);
        drop(inbox);
        for dropped in &dropped {
            S::dropped(wiring, dropped.key);
        }
        self.attend(wiring);
        // The messages of other publishers, whose `Drop` may panic, are dropped last.
        drop(dropped);
    }

    /// Adds a control entry.
    fn post_with(&self, wiring: &S::Wiring, add: impl FnOnce(&mut Inbox<Keyed<S::Message>>)) {
        if self.replayed.load(Ordering::Relaxed) {
            return;
        }
        {
            let mut inbox = self.inbox();
            add(&mut inbox);
            self.pending.store(inbox.pending().0, Ordering::Relaxed);
        }
        if self.served.load(Ordering::Relaxed) {
            self.arrived.notify_one();
        } else {
            wiring.environment().schedule_drain(S::DECLARATION.number);
        }
    }

    /// Signals the worker after an entry was added, or drains the island on this thread unless another thread holds it. That thread
    /// checks the inbox after it has released the island. The fences ensure that one of the two threads sees the other.
    fn attend(&self, wiring: &S::Wiring) {
        fence(Ordering::SeqCst);
        if self.served.load(Ordering::Relaxed) {
            self.arrived.notify_one();
            return;
        }
        if let Some(state) = self.try_hold(wiring) {
            self.leave(wiring, state);
        }
    }

    /// Releases the island, then processes any entries added to the inbox since.
    #[inline]
    fn leave(&self, wiring: &S::Wiring, state: Held<'_, S>) {
        drop(state);
        fence(Ordering::SeqCst);
        if self.pending.load(Ordering::Relaxed) != 0 || self.waiting.load(Ordering::Relaxed) != 0 {
            self.drain(wiring);
        }
    }

    /// Processes as many entries as an inbox holds, then leaves the rest to the waiting threads. They check the inbox after their wait,
    /// and the fences ensure that one of the two threads sees the other.
    #[cold]
    fn drain(&self, wiring: &S::Wiring) {
        if self.replayed.load(Ordering::Relaxed) {
            return;
        }
        // Control entries get here without a call to `attend`, hence the fence: see there.
        fence(Ordering::SeqCst);
        let mut processed = 0;
        while self.pending.load(Ordering::Relaxed) != 0 && !self.served.load(Ordering::Relaxed) {
            let Some(mut state) = self.try_hold(wiring) else { return };
            while !self.gives_way(processed) && self.process_next(&mut state, wiring) {
                processed += 1;
            }
            drop(state);
            fence(Ordering::SeqCst);
            if self.gives_way(processed) {
                break;
            }
        }
        self.tell_waiting();
    }

    /// Runs `call` once the island is free and all earlier entries have been processed. Then processes the entries added since.
    ///
    /// With a journal, `line` is written first.
    pub(crate) fn call<T>(
        &self,
        wiring: &S::Wiring,
        now: MonotonicTime,
        line: Event,
        call: impl FnOnce(&mut S, &Turn<'_>) -> T,
    ) -> Result<T, CallError> {
        if is_inside(wiring.environment().place()) {
            return Err(CallError::Inside);
        }
        let Some(mut state) = self.hold(wiring, LONGEST_CALL) else { return Err(CallError::Busy) };
        let mut processed = 0;
        while processed < S::CAPACITY && self.process_next(&mut state, wiring) {
            processed += 1;
        }
        let result = self.process(wiring, now, || line, |turn| call(&mut state, turn));
        self.leave(wiring, state);
        Ok(result)
    }

    #[inline]
    fn try_hold(&self, wiring: &S::Wiring) -> Option<Held<'_, S>> {
        let state = match self.state.try_lock() {
            Ok(state) => state,
            // A panic inside belongs to a component, and was caught and reported there.
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        Some(Within::new(state, wiring.environment().place()))
    }

    /// Returns whether a thread holds the island. The caller does not want to enter.
    fn is_held(&self, wiring: &S::Wiring) -> bool {
        let Check { is_held, has_kept } = self.check();
        if has_kept {
            wiring.environment().schedule_drain(S::DECLARATION.number);
        }
        is_held
    }

    /// Tries the lock and releases it at once. A thread that found it taken meanwhile has left its entry in the inbox for the
    /// holder, so another thread has to process that entry.
    fn check(&self) -> Check {
        let tried = self.state.try_lock();
        let is_held = matches!(tried, Err(TryLockError::WouldBlock));
        // Releasing a lock is not a step of the model. This call is a step, at which other threads find the lock taken.
        #[cfg(loom)]
        self.pending.load(Ordering::Relaxed);
        drop(tried);
        // As in `leave`: either this thread sees the entry, or the other thread has found the lock free.
        fence(Ordering::SeqCst);
        let has_kept =
            !is_held && self.pending.load(Ordering::Relaxed) != 0 && !self.served.load(Ordering::Relaxed);
        Check { is_held, has_kept }
    }

    /// Returns whether no thread holds the island. The caller checks the inbox afterwards: see [`Self::check`].
    fn is_free(&self) -> bool {
        !matches!(self.state.try_lock(), Err(TryLockError::WouldBlock))
    }

    fn inbox(&self) -> MutexGuard<'_, Inbox<Keyed<S::Message>>> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S: IslandState> fmt::Debug for Island<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Island").field("pending", &self.pending).finish_non_exhaustive()
    }
}
