//! The bounded queue between a topic and one subscriber.

use super::statistics::SubscriberStatistics;
use super::wakers::{Wakers, discard};
use crate::message::{Payload, Stamped};
use std::any::Any;
use std::collections::VecDeque;
use std::mem::needs_drop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

/// What happens to a subscriber that is slower than its publisher.
///
/// A subscription is bounded in messages and in bytes. The bytes of a message are those its payload holds on the heap
/// ([`Field::heap_bytes`](crate::Field::heap_bytes)), plus the message itself if that is larger than 1 KiB; smaller
/// ones are bounded only by their number. One message is always kept, however large it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// Keeps this many messages, and at most [`Overflow::DEFAULT_BYTES`]. Beyond that, the oldest is dropped, and the
    /// loss is counted.
    DropOldest {
        /// How many are kept: at least one, and at most [`Overflow::MAX_CAPACITY`].
        capacity: usize,
    },
    /// The same with its own bound in bytes.
    DropOldestWithin {
        /// How many are kept: at least one, and at most [`Overflow::MAX_CAPACITY`].
        capacity: usize,
        /// Total bytes of the kept messages; `usize::MAX` for no bound.
        bytes: usize,
    },
    /// Keeps only the newest message; the loss of the others is counted.
    KeepLatest,
}

impl Default for Overflow {
    fn default() -> Self {
        Self::DropOldest { capacity: 1024 }
    }
}

impl Overflow {
    /// The largest capacity of a subscription, in messages.
    pub const MAX_CAPACITY: usize = 1 << 20;

    /// Default bound on the total bytes of a subscription's messages: 64 MiB.
    pub const DEFAULT_BYTES: usize = 64 << 20;

    fn bound(self) -> Bound {
        let (capacity, bytes) = match self {
            Self::DropOldest { capacity } => (capacity, Self::DEFAULT_BYTES),
            Self::DropOldestWithin { capacity, bytes } => (capacity, bytes),
            Self::KeepLatest => (1, usize::MAX),
        };
        Bound { capacity: capacity.clamp(1, Self::MAX_CAPACITY), bytes }
    }
}

/// The bounds of a queue.
#[derive(Clone, Copy, Debug)]
struct Bound {
    capacity: usize,
    bytes: usize,
}

/// Memory that a queue reserves in advance, in bytes; beyond it, memory is allocated when messages first need it.
const ROOM_IN_ADVANCE: usize = 1 << 20;

/// A message's own size up to which it does not count towards the bytes of its subscription.
const UNCOUNTED_BYTES: usize = 1 << 10;

/// The bytes of a message that count towards the bound of a subscription.
pub(super) fn counted_bytes<T: Payload>(message: &Stamped<T>) -> usize {
    let own = const { if size_of::<Stamped<T>>() > UNCOUNTED_BYTES { size_of::<Stamped<T>>() } else { 0 } };
    if T::IS_INLINE { own } else { own.saturating_add(message.payload.heap_bytes()) }
}

/// No user code runs under its lock: messages are dropped, and wakers cloned, woken and dropped, without it.
#[derive(Debug)]
pub(super) struct Queue<M> {
    state: Mutex<State<M>>,
    arrived: Condvar,
    bound: Bound,
    /// Its reader is gone.
    abandoned: AtomicBool,
}

#[derive(Debug)]
struct State<M> {
    messages: VecDeque<Entry<M>>,
    /// The sum of the counted bytes.
    bytes: usize,
    lagged: u64,
    closed: bool,
    waker: Option<Waker>,
    /// Waiting threads: notifying nobody would cost a system call.
    waiting: usize,
}

#[derive(Debug)]
struct Entry<M> {
    message: M,
    bytes: usize,
}

/// A queue of a topic, without its payload: all that is done with it but adding messages.
pub(super) trait AnyQueue: Any + Send + Sync {
    /// See [`Queue::close`].
    fn close(&self) -> Option<Waker>;
    fn statistics(&self) -> SubscriberStatistics;
    /// Whether its reader is gone.
    fn is_abandoned(&self) -> bool;
}

impl<M: Send + 'static> AnyQueue for Queue<M> {
    fn close(&self) -> Option<Waker> {
        Queue::close(self)
    }
    fn statistics(&self) -> SubscriberStatistics {
        Queue::statistics(self)
    }
    fn is_abandoned(&self) -> bool {
        Queue::is_abandoned(self)
    }
}

impl<M: Send + 'static> Queue<M> {
    /// Adds a message of `bytes` counted bytes. Returns how many of the oldest were dropped to make room for it.
    /// Wakers and dropped messages go to `wakers`.
    pub(super) fn push(&self, message: M, bytes: usize, wakers: &mut Wakers) -> u64 {
        let mut lost = 0;
        loop {
            let mut state = self.lock();
            let mut evicted = None;
            if !self.has_room(&state, bytes) {
                evicted = state.pop();
                state.lagged += 1;
                lost += 1;
            }
            if self.has_room(&state, bytes) {
                // Under the lock, so that `abandon` takes out everything.
                if self.is_abandoned() {
                    drop(state);
                    wakers.discard(message);
                } else {
                    state.bytes += bytes;
                    state.messages.push_back(Entry { message, bytes });
                    let (waker, is_awaited) = (state.waker.take(), state.waiting > 0);
                    drop(state);
                    if is_awaited {
                        self.arrived.notify_one();
                    }
                    if let Some(waker) = waker {
                        wakers.wake(waker);
                    }
                }
                if let Some(evicted) = evicted {
                    wakers.discard(evicted);
                }
                return lost;
            }
            // A message that needs the room of several evicts them one at a time: each is dropped without the lock.
            drop(state);
            if let Some(evicted) = evicted {
                wakers.discard(evicted);
            }
        }
    }

    fn has_room(&self, state: &State<M>, bytes: usize) -> bool {
        let has_bytes = || state.bytes.checked_add(bytes).is_some_and(|sum| sum <= self.bound.bytes);
        state.messages.is_empty() || state.messages.len() < self.bound.capacity && has_bytes()
    }
}

impl<M> Queue<M> {
    /// Memory for the usual number of messages is reserved here, so publishing allocates nothing.
    pub(super) fn new(overflow: Overflow) -> Self {
        let bound = overflow.bound();
        let in_advance = bound.capacity.min(ROOM_IN_ADVANCE / size_of::<Entry<M>>());
        let state = State {
            messages: VecDeque::with_capacity(in_advance),
            bytes: 0,
            lagged: 0,
            closed: false,
            waker: None,
            waiting: 0,
        };
        Self { state: Mutex::new(state), arrived: Condvar::new(), bound, abandoned: AtomicBool::new(false) }
    }

    /// Tells the reader that no more will come. Returns the task to wake.
    #[must_use = "to wake a task is user code, which the caller runs where it harms nobody"]
    pub(super) fn close(&self) -> Option<Waker> {
        let mut state = self.lock();
        state.closed = true;
        let waker = state.waker.take();
        drop(state);
        // Several threads may wait for the same subscription, and none of them will get another message.
        self.arrived.notify_all();
        waker
    }

    /// Says that the reader is gone. Waiting messages are dropped here, and none are added from now on, so dropping
    /// the queue itself runs no user code, whatever lock is held.
    pub(super) fn abandon(&self) {
        self.abandoned.store(true, Ordering::Release);
        let mut state = self.lock();
        let messages = std::mem::take(&mut state.messages);
        state.bytes = 0;
        let waker = state.waker.take();
        drop(state);
        if needs_drop::<M>() {
            messages.into_iter().for_each(|entry| discard(entry.message));
        }
        waker.into_iter().for_each(discard);
    }

    pub(super) fn is_abandoned(&self) -> bool {
        self.abandoned.load(Ordering::Acquire)
    }

    pub(super) fn statistics(&self) -> SubscriberStatistics {
        let state = self.lock();
        SubscriberStatistics {
            is_typed: true,
            waiting: state.messages.len(),
            capacity: self.bound.capacity,
            bytes: state.bytes,
            lost: state.lagged,
        }
    }

    pub(super) fn pop(&self) -> Option<M> {
        self.lock().pop()
    }

    pub(super) fn len(&self) -> usize {
        self.lock().messages.len()
    }

    pub(super) fn lagged(&self) -> u64 {
        self.lock().lagged
    }

    /// Waits for a message until `timeout` (`None`: forever). Returns `None` after that, or once closed and empty.
    pub(super) fn wait(&self, timeout: Option<Duration>) -> Option<M> {
        let deadline = timeout.and_then(|timeout| Instant::now().checked_add(timeout));
        let mut state = self.lock();
        loop {
            if let Some(next) = state.ready() {
                return next;
            }
            state.waiting += 1;
            state = match deadline {
                None => self.arrived.wait(state).unwrap_or_else(PoisonError::into_inner),
                Some(deadline) => {
                    let left = deadline.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        state.waiting -= 1;
                        return None;
                    }
                    self.arrived.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0
                }
            };
            state.waiting -= 1;
        }
    }

    pub(super) fn poll(&self, context: &mut Context<'_>) -> Poll<Option<M>> {
        let mut state = self.lock();
        if let Some(ready) = state.ready() {
            return Poll::Ready(ready);
        }
        if state.waker.as_ref().is_some_and(|waker| waker.will_wake(context.waker())) {
            return Poll::Pending;
        }
        drop(state);
        let waker = context.waker().clone();
        let mut state = self.lock();
        // A message may have arrived meanwhile, and woken the previous waker.
        if let Some(ready) = state.ready() {
            drop(state);
            discard(waker);
            return Poll::Ready(ready);
        }
        let before = state.waker.replace(waker);
        drop(state);
        before.into_iter().for_each(discard);
        Poll::Pending
    }

    fn lock(&self) -> MutexGuard<'_, State<M>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M> State<M> {
    fn pop(&mut self) -> Option<M> {
        let Entry { message, bytes } = self.messages.pop_front()?;
        self.bytes -= bytes;
        Some(message)
    }

    /// The next message, or `Some(None)` if no more will come.
    fn ready(&mut self) -> Option<Option<M>> {
        match self.pop() {
            None if !self.closed => None,
            next => Some(next),
        }
    }
}
