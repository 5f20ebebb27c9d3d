//! Estimators that always run together, behind one lock with an inbox.
//!
//! Which estimators a message reaches is known at compile time, so `robot!` cuts the dataflow into islands: an estimator
//! that is fed by one sensor alone, directly or through others, stands in that sensor's island; one that several sensors
//! feed, or that is declared `runs_on: worker`, begins an island of its own. Inside an island a message goes from
//! estimator to estimator by plain calls on plain fields, without a lock, an atomic or a queue. At its shore stands this
//! lock: whoever publishes takes it and runs all that lies downstream; who finds it taken leaves the message in the
//! inbox, for the holder to deliver before it goes. So there is a single writer, and the order of every input is kept.

use super::WorkerDeclaration;
use crate::journal::{Event, Journal};
use crate::run::StopSignal;
use crate::time::MonotonicTime;
use std::collections::VecDeque;
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

/// What `robot!` implements for each island.
pub trait Shore: Sized + Send {
    /// The robot's wiring.
    type Wiring;
    /// What may be left in the inbox: a variant for each publisher outside that feeds it, and "something is due".
    type Message: Send;
    /// Messages that the inbox holds.
    const CAPACITY: usize = 1024;
    /// Its number.
    const NUMBER: usize;
    /// The path of its first estimator.
    const NAME: &'static str;
    /// How its own thread runs, if it has one.
    const WORKER: Option<WorkerDeclaration>;

    /// Runs all that lies downstream of a message that arrived at `now`.
    fn deliver(&mut self, wiring: &Self::Wiring, message: &Self::Message, now: MonotonicTime);
    /// Runs whatever is due: timers, ticks, restarts, losses.
    fn wake(&mut self, wiring: &Self::Wiring, now: MonotonicTime);
    /// Where the robot's journal is written, if it is.
    fn journal(wiring: &Self::Wiring) -> Option<&Journal>;
    /// Counts a message that did not fit in the inbox, wherever it would have gone.
    fn dropped(wiring: &Self::Wiring, message: &Self::Message);
    /// Stops its estimators.
    fn terminate(&mut self);
}

/// How long a publisher waits for room in a full inbox.
const LONGEST_WAIT: Duration = Duration::from_millis(100);

/// An island behind its lock.
pub struct Island<S: Shore> {
    state: Mutex<S>,
    inbox: Mutex<Inbox<S::Message>>,
    /// Whether the inbox holds anything: the one word that the holder looks at before it goes.
    pending: AtomicUsize,
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
struct Waiting<M> {
    arrived: MonotonicTime,
    key: Key,
    message: M,
}

struct Inbox<M> {
    messages: VecDeque<Waiting<M>>,
    /// Something may be due since that time.
    woken: Option<MonotonicTime>,
}

impl<M> Inbox<M> {
    fn len(&self) -> usize {
        self.messages.len() + usize::from(self.woken.is_some())
    }
}

/// What is taken from an inbox.
enum Taken<M> {
    Message(Waiting<M>),
    Wake(MonotonicTime),
}

impl<S: Shore> Island<S> {
    /// An island that nobody runs yet.
    pub fn new(state: S) -> Self {
        Self {
            state: Mutex::new(state),
            inbox: Mutex::new(Inbox { messages: VecDeque::new(), woken: None }),
            pending: AtomicUsize::new(0),
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
        self.post(wiring, Waiting { arrived: now, key, message: message() });
    }

    /// Leaves a message in the inbox and sees to it that somebody delivers it.
    #[cold]
    fn post(&self, wiring: &S::Wiring, waiting: Waiting<S::Message>) {
        let mut inbox = unpoisoned(self.inbox.lock());
        // Room is made once, at the first message that has to wait.
        if inbox.messages.capacity() == 0 {
            inbox.messages.reserve_exact(S::CAPACITY);
        }
        if self.replayed.load(Ordering::Relaxed) {
            inbox.messages.push_back(waiting);
            return;
        }
        if inbox.messages.len() >= S::CAPACITY && !self.served.load(Ordering::Relaxed) {
            drop(inbox);
            self.wait_for_room();
            inbox = unpoisoned(self.inbox.lock());
        }
        let dropped = if inbox.messages.len() < S::CAPACITY { None } else { inbox.messages.pop_front() };
        inbox.messages.push_back(waiting);
        self.pending.store(inbox.len(), Ordering::Relaxed);
        drop(inbox);
        if let Some(dropped) = dropped {
            if let Some(journal) = S::journal(wiring) {
                let Key { entry, line } = dropped.key;
                journal.write(dropped.arrived, Event::Drop { island: S::NUMBER, entry, message: line });
            }
            S::dropped(wiring, &dropped.message);
        }
        self.attend(wiring);
    }

    /// Somebody runs the island and delivers as fast as he can: whoever floods it meanwhile waits for him, but not for one
    /// that hangs.
    fn wait_for_room(&self) {
        let start = std::time::Instant::now();
        while self.pending.load(Ordering::Relaxed) >= S::CAPACITY && start.elapsed() < LONGEST_WAIT {
            std::thread::yield_now();
        }
    }

    fn wake_up(&self, wiring: &S::Wiring, now: MonotonicTime) {
        if self.replayed.load(Ordering::Relaxed) {
            return;
        }
        {
            let mut inbox = unpoisoned(self.inbox.lock());
            inbox.woken = Some(now);
            self.pending.store(inbox.len(), Ordering::Relaxed);
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
    fn leave(&self, wiring: &S::Wiring, state: MutexGuard<'_, S>) {
        drop(state);
        fence(Ordering::SeqCst);
        if self.pending.load(Ordering::Relaxed) != 0 {
            self.drain(wiring);
        }
    }

    #[cold]
    fn drain(&self, wiring: &S::Wiring) {
        if self.replayed.load(Ordering::Relaxed) {
            return;
        }
        while self.pending.load(Ordering::Relaxed) != 0 {
            let Some(mut state) = self.try_lock() else { return };
            while let Some(taken) = self.take() {
                Self::run(&mut state, wiring, taken);
            }
            drop(state);
            fence(Ordering::SeqCst);
        }
    }

    fn run(state: &mut S, wiring: &S::Wiring, taken: Taken<S::Message>) {
        match taken {
            Taken::Message(Waiting { arrived, key, message }) => {
                Self::write(wiring, arrived, key);
                state.deliver(wiring, &message, arrived);
            }
            Taken::Wake(now) => {
                if let Some(journal) = S::journal(wiring) {
                    journal.write(now, Event::Wake { island: S::NUMBER });
                }
                state.wake(wiring, now);
            }
        }
    }

    /// The first message of that key.
    fn take_replayed(&self, key: Key) -> Option<Waiting<S::Message>> {
        let mut inbox = unpoisoned(self.inbox.lock());
        let position = inbox.messages.iter().position(|waiting| waiting.key == key)?;
        inbox.messages.remove(position)
    }

    /// Writes into the journal, if there is one, what is delivered now; the island is held.
    #[inline]
    fn write(wiring: &S::Wiring, now: MonotonicTime, key: Key) {
        if let Some(journal) = S::journal(wiring) {
            journal.write(now, Event::Deliver { island: S::NUMBER, entry: key.entry, message: key.line });
        }
    }

    fn take(&self) -> Option<Taken<S::Message>> {
        let mut inbox = unpoisoned(self.inbox.lock());
        let taken = match inbox.messages.pop_front() {
            Some(waiting) => Some(Taken::Message(waiting)),
            None => inbox.woken.take().map(Taken::Wake),
        };
        self.pending.store(inbox.len(), Ordering::Relaxed);
        taken
    }

    /// Runs `call` once the island is free, then what has come meanwhile; none after `timeout`.
    pub fn with<T>(
        &self,
        wiring: &S::Wiring,
        timeout: Option<Duration>,
        call: impl FnOnce(&mut S) -> T,
    ) -> Option<T> {
        let mut state = match timeout {
            None => unpoisoned(self.state.lock()),
            Some(timeout) => self.lock_within(timeout)?,
        };
        let result = call(&mut state);
        self.leave(wiring, state);
        Some(result)
    }

    fn lock_within(&self, timeout: Duration) -> Option<MutexGuard<'_, S>> {
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

    fn try_lock(&self) -> Option<MutexGuard<'_, S>> {
        match self.state.try_lock() {
            Ok(state) => Some(state),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}

/// What all islands of a robot with the wiring `W` have in common.
pub trait AnyIsland<W>: Sync {
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
        S::NAME
    }

    fn wake(&self, wiring: &S::Wiring, now: MonotonicTime) {
        self.wake_up(wiring, now);
    }

    fn worker(&self) -> Option<WorkerDeclaration> {
        S::WORKER
    }

    fn give_to_thread(&self) {
        unpoisoned(self.inbox.lock()).messages.reserve_exact(S::CAPACITY);
        self.served.store(true, Ordering::SeqCst);
    }

    fn serve(&self, wiring: &S::Wiring, stop: &StopSignal) {
        while !stop.is_set() {
            let mut inbox = unpoisoned(self.inbox.lock());
            if inbox.len() == 0 {
                // Told when a message comes; the time is for `stop`.
                inbox = unpoisoned(self.arrived.wait_timeout(inbox, Duration::from_millis(50))).0;
            }
            drop(inbox);
            let mut state = unpoisoned(self.state.lock());
            while let Some(taken) = self.take() {
                Self::run(&mut state, wiring, taken);
                if stop.is_set() {
                    break;
                }
            }
        }
        self.served.store(false, Ordering::SeqCst);
    }

    fn begin_replay(&self) {
        self.replayed.store(true, Ordering::Relaxed);
        // Whoever publishes finds it taken.
        self.pending.store(usize::MAX / 2, Ordering::Relaxed);
    }

    fn replay(&self, wiring: &S::Wiring, key: Key, now: MonotonicTime) -> bool {
        let Some(waiting) = self.take_replayed(key) else { return false };
        unpoisoned(self.state.lock()).deliver(wiring, &waiting.message, now);
        true
    }

    fn replay_drop(&self, wiring: &S::Wiring, key: Key) -> bool {
        let Some(waiting) = self.take_replayed(key) else { return false };
        S::dropped(wiring, &waiting.message);
        true
    }

    fn replay_wake(&self, wiring: &S::Wiring, now: MonotonicTime) {
        unpoisoned(self.state.lock()).wake(wiring, now);
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
