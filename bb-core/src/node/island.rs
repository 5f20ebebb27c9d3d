//! Estimators that always run together, behind one lock with an inbox.
//!
//! Which estimators a message reaches is known at compile time, so `robot!` cuts the dataflow into islands: an estimator
//! that is fed by one sensor alone, directly or through others, stands in that sensor's island; one that several sensors
//! feed, or that is declared `runs_on: worker`, begins an island of its own. Inside an island a message goes from
//! estimator to estimator by plain calls on plain fields, without a lock, an atomic or a queue. At its shore stands this
//! lock: whoever publishes takes it and runs all that lies downstream; who finds it taken leaves the message in the
//! inbox, for the holder to deliver before it goes. So there is a single writer, and the order of every input is kept.

mod inbox;
mod inside;
#[cfg(all(test, loom))]
mod model;

use self::inbox::{Inbox, Pending, Taken};
use self::inside::{Inside, Within};
use super::{IslandDeclaration, WorkerDeclaration};
use crate::journal::{Event, Journal};
use crate::run::StopSignal;
use crate::time::MonotonicTime;
use std::fmt;
use std::time::Duration;

#[cfg(loom)]
use loom::sync::{
    Condvar, Mutex, MutexGuard,
    atomic::{AtomicBool, AtomicUsize, Ordering, fence},
};
#[cfg(not(loom))]
use std::sync::{
    Condvar, Mutex, MutexGuard,
    atomic::{AtomicBool, AtomicUsize, Ordering, fence},
};
use std::sync::{PoisonError, TryLockError};

/// What `robot!` implements for its wiring.
pub trait Sea {
    /// Where the robot's journal is written, if it is.
    fn journal(&self) -> Option<&Journal>;
}

/// What `robot!` implements for each island. That all may go to other threads is asked of the whole wiring: of each it
/// would be proven again wherever the island is named.
pub trait Shore: Sized {
    /// The robot's wiring.
    type Wiring: Sea;
    /// What may be left in the inbox: a variant for each publisher outside that feeds it, and "something is due".
    type Message;
    /// Messages that the inbox holds.
    const CAPACITY: usize = 1024;
    /// It, as declared.
    const DECLARATION: IslandDeclaration;

    /// Runs all that lies downstream of a message that arrived at `now`.
    fn deliver(&mut self, wiring: &Self::Wiring, message: &Self::Message, now: MonotonicTime);
    /// Runs whatever is due: timers, ticks, restarts, losses.
    fn wake(&mut self, wiring: &Self::Wiring, now: MonotonicTime);
    /// Counts a message that did not fit in the inbox, wherever it would have gone.
    fn dropped(wiring: &Self::Wiring, message: &Self::Message);
    /// Stops its estimators.
    fn terminate(&mut self);
}

/// How long a publisher waits for room in a full inbox.
const LONGEST_WAIT: Duration = Duration::from_millis(500);

/// An island behind its lock.
pub struct Island<S: Shore> {
    state: Mutex<S>,
    inbox: Mutex<Inbox<Keyed<S::Message>>>,
    /// What the inbox holds: the one word that the holder looks at before it goes.
    pending: AtomicUsize,
    /// Callers that wait for the island, and publishers that wait for room in its inbox.
    waiting: AtomicUsize,
    /// A publisher has waited for room in vain: the holder hangs, until it takes the next message.
    hangs: AtomicBool,
    arrived: Condvar,
    /// Whether a thread of its own serves it.
    served: AtomicBool,
    /// Whether a journal says when its messages are delivered.
    replayed: AtomicBool,
}

/// What a message is known by: which of the island's publishers it is from, and the number of its line in the journal, if
/// there is one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// The publisher, as the island numbers them.
    pub entry: usize,
    /// The line; 0 if there is none.
    pub line: u64,
}

/// A message that waits.
struct Keyed<M> {
    key: Key,
    message: M,
}

/// An island that the calling thread holds.
pub type Held<'a, S> = Within<MutexGuard<'a, S>>;

impl<S: Shore> Island<S> {
    /// An island that nobody runs yet.
    pub fn new(state: S) -> Self {
        Self {
            state: Mutex::new(state),
            inbox: Mutex::new(Inbox::new()),
            pending: AtomicUsize::new(0),
            waiting: AtomicUsize::new(0),
            hangs: AtomicBool::new(false),
            arrived: Condvar::new(),
            served: AtomicBool::new(false),
            replayed: AtomicBool::new(false),
        }
    }

    /// Runs `direct` if the island is free; else leaves `message` in the inbox.
    #[inline]
    pub fn enter(
        &self,
        wiring: &S::Wiring,
        now: MonotonicTime,
        key: Key,
        direct: impl FnOnce(&mut S),
        message: impl FnOnce() -> S::Message,
    ) {
        if self.pending.load(Ordering::Relaxed) == 0
            && !self.served.load(Ordering::Relaxed)
            && let Some(mut state) = self.try_lock()
        {
            Self::write(wiring, now, key);
            direct(&mut state);
            return self.leave(wiring, state);
        }
        self.post(wiring, now, Keyed { key, message: message() });
    }

    /// Leaves a message in the inbox and sees to it that somebody delivers it.
    #[cold]
    fn post(&self, wiring: &S::Wiring, now: MonotonicTime, message: Keyed<S::Message>) {
        let mut inbox = self.inbox();
        // Room is made once, at the first message that has to wait.
        inbox.reserve(S::CAPACITY);
        if self.replayed.load(Ordering::Relaxed) {
            return inbox.push(now, message);
        }
        while !inbox.has_room(S::CAPACITY) && !self.served.load(Ordering::Relaxed) {
            drop(inbox);
            let has_waited = self.wait_for_room();
            self.attend(wiring);
            inbox = self.inbox();
            // Else somebody else may have taken the room that there was.
            if !has_waited {
                break;
            }
        }
        let dropped = if inbox.has_room(S::CAPACITY) { None } else { inbox.pop() };
        inbox.push(now, message);
        self.pending.store(inbox.pending().0, Ordering::Relaxed);
        drop(inbox);
        if let Some(dropped) = dropped {
            if let Some(journal) = wiring.journal() {
                let Key { entry, line } = dropped.key;
                journal.write(now, Event::Drop { island: S::DECLARATION.number, entry, message: line });
            }
            S::dropped(wiring, &dropped.message);
        }
        self.attend(wiring);
    }

    /// Somebody runs the island and delivers as fast as he can: whoever floods it meanwhile waits for him, but not for one
    /// that hangs, nor for himself. True once there may be room.
    fn wait_for_room(&self) -> bool {
        if self.hangs.load(Ordering::Relaxed) || Inside::is_here() {
            return false;
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let has_room = || Pending(self.pending.load(Ordering::Relaxed)).has_room(S::CAPACITY);
        let in_time = inside::until(LONGEST_WAIT, || has_room() || self.is_free());
        if !in_time {
            self.hangs.store(true, Ordering::Relaxed);
        }
        // Before it attends to the inbox: see `drain`.
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        in_time
    }

    fn wake_up(&self, wiring: &S::Wiring, now: MonotonicTime) {
        if self.replayed.load(Ordering::Relaxed) {
            return;
        }
        {
            let mut inbox = self.inbox();
            inbox.wake(now);
            self.pending.store(inbox.pending().0, Ordering::Relaxed);
        }
        self.attend(wiring);
    }

    /// Behind a message in the inbox: its own thread is told, or it is delivered here, unless somebody holds the island.
    /// He looks at the inbox after he has let go; the fences make sure that one of the two sees the other.
    fn attend(&self, wiring: &S::Wiring) {
        if self.served.load(Ordering::Relaxed) {
            self.arrived.notify_one();
            return;
        }
        fence(Ordering::SeqCst);
        if let Some(state) = self.try_lock() {
            self.leave(wiring, state);
        }
    }

    /// Delivers what has come into the inbox meanwhile, and lets go.
    #[inline]
    pub fn leave(&self, wiring: &S::Wiring, state: Held<'_, S>) {
        drop(state);
        fence(Ordering::SeqCst);
        if self.pending.load(Ordering::Relaxed) != 0 {
            self.drain(wiring);
        }
    }

    /// Once it has delivered as much as an inbox holds, it lets those who wait go on in its place: they attend to the inbox
    /// after they have ceased to wait, and the fences make sure that one of the two sees the other.
    #[cold]
    fn drain(&self, wiring: &S::Wiring) {
        let mut delivered = 0;
        if self.replayed.load(Ordering::Relaxed) {
            return;
        }
        while self.pending.load(Ordering::Relaxed) != 0 {
            let Some(mut state) = self.try_lock() else { return };
            while !self.gives_way(delivered)
                && let Some(taken) = self.take()
            {
                Self::run(&mut state, wiring, taken);
                delivered += 1;
            }
            drop(state);
            fence(Ordering::SeqCst);
            if self.gives_way(delivered) {
                return;
            }
        }
    }

    fn gives_way(&self, delivered: usize) -> bool {
        delivered >= S::CAPACITY && self.waiting.load(Ordering::Relaxed) != 0
    }

    fn run(state: &mut S, wiring: &S::Wiring, taken: Taken<Keyed<S::Message>>) {
        match taken {
            Taken::Message(now, Keyed { key, message }) => {
                Self::write(wiring, now, key);
                state.deliver(wiring, &message, now);
            }
            Taken::Wake(now) => {
                if let Some(journal) = wiring.journal() {
                    journal.write(now, Event::Wake { island: S::DECLARATION.number });
                }
                state.wake(wiring, now);
            }
        }
    }

    /// Writes into the journal, if there is one, what is delivered now; the island is held.
    #[inline]
    fn write(wiring: &S::Wiring, now: MonotonicTime, key: Key) {
        if let Some(journal) = wiring.journal() {
            journal
                .write(now, Event::Deliver { island: S::DECLARATION.number, entry: key.entry, message: key.line });
        }
    }

    fn take(&self) -> Option<Taken<Keyed<S::Message>>> {
        let mut inbox = self.inbox();
        let taken = inbox.take();
        self.pending.store(inbox.pending().0, Ordering::Relaxed);
        self.hangs.store(false, Ordering::Relaxed);
        taken
    }

    /// Runs `call` once the island is free, then what has come meanwhile; none after `timeout`, and none if the caller has
    /// been called by an estimator's message himself: he could wait for ever.
    pub fn with<T>(
        &self,
        wiring: &S::Wiring,
        timeout: Option<Duration>,
        call: impl FnOnce(&mut S) -> T,
    ) -> Option<T> {
        let mut state = match timeout {
            None => self.hold()?,
            Some(timeout) => self.lock_within(timeout)?,
        };
        let result = call(&mut state);
        self.leave(wiring, state);
        Some(result)
    }

    /// Takes the island once it is free; `None` on a thread that is inside one. [`Self::leave`] gives it back.
    pub fn hold(&self) -> Option<Held<'_, S>> {
        if Inside::is_here() {
            return None;
        }
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let state = Within::new(unpoisoned(self.state.lock()));
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        Some(state)
    }

    fn lock_within(&self, timeout: Duration) -> Option<Held<'_, S>> {
        let timeout = if Inside::is_here() { Duration::ZERO } else { timeout };
        let start = std::time::Instant::now();
        loop {
            if let Some(state) = self.try_lock() {
                return Some(state);
            }
            if start.elapsed() >= timeout {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[inline]
    fn try_lock(&self) -> Option<Held<'_, S>> {
        match self.state.try_lock() {
            Ok(state) => Some(Within::new(state)),
            Err(TryLockError::Poisoned(poisoned)) => Some(Within::new(poisoned.into_inner())),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    fn is_free(&self) -> bool {
        self.try_lock().is_some()
    }

    fn inbox(&self) -> MutexGuard<'_, Inbox<Keyed<S::Message>>> {
        unpoisoned(self.inbox.lock())
    }
}

/// What all islands of a robot with the wiring `W` have in common.
pub trait AnyIsland<W> {
    /// The path of its first estimator.
    fn name(&self) -> &'static str;
    /// Something may be due.
    fn wake(&self, wiring: &W, now: MonotonicTime);
    /// How its own thread runs, if it has one.
    fn worker(&self) -> Option<WorkerDeclaration>;
    /// From now on a thread of its own serves it, see [`Self::serve`].
    fn give_to_thread(&self);
    /// Delivers what comes, on the calling thread, until the robot stops.
    fn serve(&self, wiring: &W, stop: &StopSignal);
    /// From now on messages wait until [`Self::replay`] delivers them.
    fn begin_replay(&self);
    /// Delivers the first message of that key; false if there is none.
    fn replay(&self, wiring: &W, key: Key, now: MonotonicTime) -> bool;
    /// Drops the first message of that key; false if there is none.
    fn replay_drop(&self, wiring: &W, key: Key) -> bool;
    /// Does what is due.
    fn replay_wake(&self, wiring: &W, now: MonotonicTime);
    /// Stops its estimators once they are free; false if they are still busy after `timeout`.
    fn terminate(&self, wiring: &W, timeout: Duration) -> bool;
}

#[cfg(not(loom))]
impl<S: Shore> AnyIsland<S::Wiring> for Island<S> {
    fn name(&self) -> &'static str {
        S::DECLARATION.name
    }

    fn wake(&self, wiring: &S::Wiring, now: MonotonicTime) {
        self.wake_up(wiring, now);
    }

    fn worker(&self) -> Option<WorkerDeclaration> {
        S::DECLARATION.worker
    }

    fn give_to_thread(&self) {
        self.inbox().reserve(S::CAPACITY);
        self.served.store(true, Ordering::SeqCst);
    }

    fn serve(&self, wiring: &S::Wiring, stop: &StopSignal) {
        while !stop.is_set() {
            let inbox = self.inbox();
            if inbox.pending() == Pending::NOTHING {
                // Told when a message comes; the time is for `stop`.
                drop(unpoisoned(self.arrived.wait_timeout(inbox, Duration::from_millis(50))));
            } else {
                drop(inbox);
            }
            let mut state = Within::new(unpoisoned(self.state.lock()));
            while !stop.is_set()
                && let Some(taken) = self.take()
            {
                Self::run(&mut state, wiring, taken);
                if self.waiting.load(Ordering::Relaxed) != 0 {
                    break;
                }
            }
            drop(state);
            // A lock is not fair, and this thread would be faster than those who have to be woken.
            inside::until(Duration::from_millis(1), || self.waiting.load(Ordering::Relaxed) == 0);
        }
        self.served.store(false, Ordering::SeqCst);
    }

    fn begin_replay(&self) {
        self.replayed.store(true, Ordering::Relaxed);
        // Whoever publishes finds it taken.
        self.pending.store(usize::MAX, Ordering::Relaxed);
    }

    fn replay(&self, wiring: &S::Wiring, key: Key, now: MonotonicTime) -> bool {
        let Some(waiting) = self.inbox().take_first(|waiting| waiting.key == key) else { return false };
        Within::new(unpoisoned(self.state.lock())).deliver(wiring, &waiting.message, now);
        true
    }

    fn replay_drop(&self, wiring: &S::Wiring, key: Key) -> bool {
        let Some(waiting) = self.inbox().take_first(|waiting| waiting.key == key) else { return false };
        S::dropped(wiring, &waiting.message);
        true
    }

    fn replay_wake(&self, wiring: &S::Wiring, now: MonotonicTime) {
        Within::new(unpoisoned(self.state.lock())).wake(wiring, now);
    }

    fn terminate(&self, wiring: &S::Wiring, timeout: Duration) -> bool {
        self.with(wiring, Some(timeout), S::terminate).is_some()
    }
}

fn unpoisoned<G>(result: Result<G, PoisonError<G>>) -> G {
    // A panic inside is a component's, and was caught and reported there.
    result.unwrap_or_else(PoisonError::into_inner)
}

impl<S: Shore> fmt::Debug for Island<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Island").field("pending", &self.pending).finish_non_exhaustive()
    }
}
