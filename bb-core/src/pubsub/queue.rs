//! The bounded queue between a topic and one subscriber.

use super::SubscriberStatistics;
use std::collections::VecDeque;
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
    /// Threads that wait: telling nobody would cost a system call.
    waiting: usize,
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

    /// Adds a message; true if the oldest had to make room for it.
    pub(super) fn push(&self, message: M) -> bool {
        let mut state = self.lock();
        let is_full = state.messages.len() == self.capacity;
        if is_full {
            state.messages.pop_front();
            state.lagged += 1;
        }
        state.messages.push_back(message);
        self.wake(state);
        is_full
    }

    pub(super) fn close(&self) {
        let mut state = self.lock();
        state.closed = true;
        let waker = state.waker.take();
        drop(state);
        // Several threads may wait for the same subscription, and none of them will get a message any more.
        self.arrived.notify_all();
        if let Some(waker) = waker {
            crate::run::wake(waker);
        }
    }

    /// Says that nobody reads it any more; what waits is dropped.
    pub(super) fn abandon(&self) {
        self.abandoned.store(true, Ordering::Release);
        let messages = std::mem::take(&mut self.lock().messages);
        drop(messages);
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

    /// Waits for a message until `timeout` (none: for ever); none after the time, or once closed and empty.
    pub(super) fn wait(&self, timeout: Option<Duration>) -> Option<M> {
        let deadline = timeout.and_then(|timeout| Instant::now().checked_add(timeout));
        let mut state = self.lock();
        loop {
            if let Some(message) = state.messages.pop_front() {
                return Some(message);
            }
            if state.closed {
                return None;
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
        if let Some(message) = state.messages.pop_front() {
            return Poll::Ready(Some(message));
        }
        if state.closed {
            return Poll::Ready(None);
        }
        match &mut state.waker {
            Some(waker) => waker.clone_from(context.waker()),
            none => *none = Some(context.waker().clone()),
        }
        Poll::Pending
    }

    fn wake(&self, mut state: MutexGuard<'_, State<M>>) {
        let (waker, is_awaited) = (state.waker.take(), state.waiting > 0);
        drop(state);
        if is_awaited {
            self.arrived.notify_one();
        }
        if let Some(waker) = waker {
            crate::run::wake(waker);
        }
    }

    fn lock(&self) -> MutexGuard<'_, State<M>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
