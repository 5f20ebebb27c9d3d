//! The bounded queue between a topic and one subscriber.

use super::SubscriberStatistics;
use super::wakers::{Wakers, discard, wake};
use std::collections::VecDeque;
use std::mem::needs_drop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

/// What happens to a subscriber that is slower than its publisher.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// Keeps so many messages; then the oldest makes room, and the loss is counted.
    DropOldest {
        /// How many are kept: at least one, and at most [`Overflow::MAX_CAPACITY`]. The room is made at once.
        capacity: usize,
    },
    /// Keeps the newest alone; the loss of the others is counted.
    KeepLatest,
}

impl Default for Overflow {
    fn default() -> Self {
        Self::DropOldest { capacity: 1024 }
    }
}

impl Overflow {
    /// The largest capacity of a subscription.
    pub const MAX_CAPACITY: usize = 1 << 20;

    fn capacity(self) -> usize {
        match self {
            Self::DropOldest { capacity } => capacity.clamp(1, Self::MAX_CAPACITY),
            Self::KeepLatest => 1,
        }
    }
}

/// No user's code runs under its lock: messages are dropped, and wakers cloned, woken and dropped, without it.
#[derive(Debug)]
pub(super) struct Queue<M> {
    state: Mutex<State<M>>,
    arrived: Condvar,
    capacity: usize,
    /// Nobody reads it any more.
    abandoned: AtomicBool,
}

#[derive(Debug)]
struct State<M> {
    messages: VecDeque<M>,
    lagged: u64,
    closed: bool,
    waker: Option<Waker>,
    /// Threads that wait: notifying nobody would cost a system call.
    waiting: usize,
}

impl<M: Send + 'static> Queue<M> {
    /// Adds a message; how many of the oldest had to make room for it. What is to be woken and dropped goes to `wakers`.
    pub(super) fn push(&self, message: M, wakers: &mut Wakers) -> u64 {
        let mut state = self.lock();
        // Under the lock, so that what `abandon` takes out is all there is.
        if self.is_abandoned() {
            drop(state);
            wakers.discard(message);
            return 0;
        }
        let evicted = if state.messages.len() == self.capacity { state.messages.pop_front() } else { None };
        let lost = u64::from(evicted.is_some());
        state.lagged += lost;
        state.messages.push_back(message);
        let (waker, is_awaited) = (state.waker.take(), state.waiting > 0);
        drop(state);
        if is_awaited {
            self.arrived.notify_one();
        }
        if let Some(waker) = waker {
            wakers.wake(waker);
        }
        if let Some(evicted) = evicted {
            wakers.discard(evicted);
        }
        lost
    }
}

impl<M> Queue<M> {
    /// All its room is made here, so that publishing allocates nothing.
    pub(super) fn new(overflow: Overflow) -> Self {
        let capacity = overflow.capacity();
        let state = State {
            messages: VecDeque::with_capacity(capacity),
            lagged: 0,
            closed: false,
            waker: None,
            waiting: 0,
        };
        Self { state: Mutex::new(state), arrived: Condvar::new(), capacity, abandoned: AtomicBool::new(false) }
    }

    /// Tells the reader that no more will come.
    pub(super) fn close(&self) {
        let mut state = self.lock();
        state.closed = true;
        let waker = state.waker.take();
        drop(state);
        // Several threads may wait for the same subscription, and none of them will get a message any more.
        self.arrived.notify_all();
        if let Some(waker) = waker {
            wake(waker);
        }
    }

    /// Says that nobody reads it any more. What waits is dropped here, and nothing is added from now on: whoever drops the
    /// queue itself, under whatever lock, runs no user's code.
    pub(super) fn abandon(&self) {
        self.abandoned.store(true, Ordering::Release);
        let mut state = self.lock();
        let messages = std::mem::take(&mut state.messages);
        let waker = state.waker.take();
        drop(state);
        if needs_drop::<M>() {
            messages.into_iter().for_each(discard);
        }
        waker.into_iter().for_each(discard);
    }

    pub(super) fn is_abandoned(&self) -> bool {
        self.abandoned.load(Ordering::Acquire)
    }

    pub(super) fn statistics(&self, is_typed: bool) -> SubscriberStatistics {
        let state = self.lock();
        SubscriberStatistics {
            is_typed,
            waiting: state.messages.len(),
            capacity: self.capacity,
            lost: state.lagged,
        }
    }

    pub(super) fn pop(&self) -> Option<M> {
        self.lock().messages.pop_front()
    }

    pub(super) fn len(&self) -> usize {
        self.lock().messages.len()
    }

    pub(super) fn lagged(&self) -> u64 {
        self.lock().lagged
    }

    /// Waits for a message until `timeout` (`None`: without end); `None` after that, or once closed and empty.
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
        // A message may have arrived meanwhile, and woken the waker of before.
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
    /// The next message, or `Some(None)` if no more will come.
    fn ready(&mut self) -> Option<Option<M>> {
        match self.messages.pop_front() {
            None if !self.closed => None,
            next => Some(next),
        }
    }
}
