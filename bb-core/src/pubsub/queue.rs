//! The bounded queue between a topic and one subscriber.

mod by_path;

use self::by_path::{ByPath, Dropped, Paths};
use super::bound::{Bound, Held};
use super::delivery::{Delivery, Overflow};
use super::statistics::SubscriberStatistics;
use super::timer::Timer;
use super::wakers::Wakers;
use crate::fault::discard;
use crate::time::MonotonicTime;
use std::any::Any;
use std::collections::VecDeque;
use std::mem::needs_drop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

/// Paths for whose messages a queue that keeps one of each reserves memory.
const USUAL_PATHS: usize = 64;

/// No user code runs under its lock: messages are dropped, and wakers cloned, woken and dropped, without it.
#[derive(Debug)]
pub(super) struct Queue<M> {
    state: Mutex<State<M>>,
    arrived: Condvar,
    bound: Bound,
    /// The reader wants the newest alone: what makes room for it is no loss.
    keeps_newest: bool,
    by_path: Option<Box<ByPath>>,
    /// `true` once the reader is gone.
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
    paths: Paths<M>,
}

#[derive(Debug)]
struct Entry<M> {
    message: M,
    bytes: usize,
}

/// A queue of a topic, without its payload: all that is done with it but adding messages.
pub(super) trait AnyQueue: Any + Send + Sync {
    /// Closes the queue, see [`Queue::close`].
    fn close(&self) -> Option<Waker>;
    fn statistics(&self) -> SubscriberStatistics;
    /// Returns whether its reader is gone.
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
    /// Memory for the usual number of messages is reserved here, so publishing allocates nothing.
    pub(super) fn shared(delivery: Delivery, timer: &Timer) -> Arc<Self> {
        Arc::new_cyclic(|queue| {
            let by_path = ByPath::of(delivery, timer, queue).map(Box::new);
            Self::with(delivery.overflow, by_path)
        })
    }

    /// Adds a message of `bytes` counted bytes. Returns the number of messages that were lost to make room for it.
    /// Wakers and dropped messages go to `wakers`.
    pub(super) fn push(&self, path: &'static str, message: M, bytes: usize, wakers: &mut Wakers) -> u64 {
        if let Some(by_path) = &self.by_path {
            return self.push_by_path(by_path, path, Entry { message, bytes }, wakers);
        }
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
                return self.loss(lost);
            }
            // A message that needs the room of several evicts them one at a time: each is dropped without the lock.
            drop(state);
            if let Some(evicted) = evicted {
                wakers.discard(evicted);
            }
        }
    }

    fn push_by_path(&self, by: &ByPath, path: &'static str, entry: Entry<M>, wakers: &mut Wakers) -> u64 {
        let mut state = self.lock();
        // Under the lock, so that `abandon` takes out everything.
        if self.is_abandoned() {
            drop(state);
            wakers.discard(entry.message);
            return 0;
        }
        let dropped = self.arrive(by, &mut state, path, entry);
        match self.woken(&mut state) {
            Some(waker) => wakers.wake(waker),
            // It sets the alarm once no lock is held.
            None if state.is_awaited() && state.paths.needs_alarm() => wakers.wake(by.waker()),
            None => {}
        }
        drop(state);
        dropped.messages.into_iter().for_each(|message| wakers.discard(message));
        self.loss(dropped.lost)
    }
}

impl<M> Queue<M> {
    /// Returns how many of the messages that were dropped for newer ones the reader has lost.
    fn loss(&self, dropped: u64) -> u64 {
        if self.keeps_newest { 0 } else { dropped }
    }

    #[cfg(test)]
    pub(super) fn new(overflow: Overflow) -> Self {
        Self::with(overflow, None)
    }

    fn with(overflow: Overflow, by_path: Option<Box<ByPath>>) -> Self {
        let bound = overflow.bound();
        let usual =
            if overflow == Overflow::LatestPerPath { bound.capacity.min(USUAL_PATHS) } else { bound.capacity };
        let in_advance = Bound { capacity: usual, ..bound }.in_advance::<Entry<M>>();
        let state = State {
            messages: VecDeque::with_capacity(in_advance),
            bytes: 0,
            lagged: 0,
            closed: false,
            waker: None,
            waiting: 0,
            paths: Paths::default(),
        };
        let keeps_newest = matches!(overflow, Overflow::KeepLatest | Overflow::LatestPerPath);
        let abandoned = AtomicBool::new(false);
        Self { state: Mutex::new(state), arrived: Condvar::new(), bound, keeps_newest, by_path, abandoned }
    }

    fn has_room(&self, state: &State<M>, bytes: usize) -> bool {
        let held = Held { messages: state.messages.len(), bytes: state.bytes };
        self.bound.has_room(held, bytes)
    }

    /// Wakes a waiting thread for each message, of which several may have become due at once, and gives the task to wake.
    fn woken(&self, state: &mut State<M>) -> Option<Waker> {
        match state.messages.len().min(state.waiting) {
            0 if state.messages.is_empty() => return None,
            0 => {}
            1 => self.arrived.notify_one(),
            _ => self.arrived.notify_all(),
        }
        state.waker.take()
    }

    /// Delivers what has waited for its time until now. What is dropped for it is returned.
    fn refresh(&self, state: &mut State<M>) -> Vec<M> {
        let mut dropped = Dropped::default();
        if let Some(by) = &self.by_path
            && let Some(now) = by.now()
        {
            self.release(by, state, now, &mut dropped);
        }
        dropped.messages
    }

    /// Reads the state after it was brought up to date.
    fn refreshed<T>(&self, read: impl FnOnce(&mut State<M>) -> T) -> T {
        let mut state = self.lock();
        let dropped = self.refresh(&mut state);
        let result = read(&mut state);
        drop(state);
        dropped.into_iter().for_each(discard);
        result
    }

    /// The time of an alarm has come, or one is to be set.
    fn ring(&self) {
        let Some(by) = &self.by_path else { return };
        let mut state = self.lock();
        if let Some(now) = by.now() {
            state.paths.rang(now);
        }
        let dropped = self.refresh(&mut state);
        let waker = self.woken(&mut state);
        let alarm = if state.is_awaited() { state.paths.arm() } else { None };
        drop(state);
        alarm.into_iter().for_each(|time| by.wake_at(time));
        dropped.into_iter().for_each(discard);
        // Who rings wakes a task as well, and counts its panic.
        if let Some(waker) = waker {
            waker.wake();
        }
    }

    /// Delivers all that waits for its time, and has nothing wait any more. Returns the task to wake.
    #[must_use = "to wake a task is user code, which the caller runs where it harms nobody"]
    pub(super) fn hurry(&self) -> Option<Waker> {
        let mut state = self.lock();
        let dropped = self.end_waiting(&mut state);
        let waker = self.woken(&mut state);
        drop(state);
        dropped.into_iter().for_each(discard);
        waker
    }

    fn end_waiting(&self, state: &mut State<M>) -> Vec<M> {
        let mut dropped = Dropped::default();
        if let Some(by) = &self.by_path {
            self.release(by, state, MonotonicTime::MAX, &mut dropped);
            state.paths.end();
        }
        dropped.messages
    }

    /// Tells the reader that no more will come. Returns the task to wake.
    #[must_use = "to wake a task is user code, which the caller runs where it harms nobody"]
    pub(super) fn close(&self) -> Option<Waker> {
        let mut state = self.lock();
        state.closed = true;
        let dropped = self.end_waiting(&mut state);
        let waker = state.waker.take();
        drop(state);
        dropped.into_iter().for_each(discard);
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
        let held = state.paths.clear();
        state.bytes = 0;
        let waker = state.waker.take();
        drop(state);
        held.for_each(discard);
        if needs_drop::<M>() {
            messages.into_iter().for_each(|entry| discard(entry.message));
        }
        waker.into_iter().for_each(discard);
    }

    #[cfg(test)]
    pub(super) fn paths_known(&self) -> usize {
        self.lock().paths.len()
    }

    #[cfg(test)]
    pub(super) fn threads_waiting(&self) -> usize {
        self.lock().waiting
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
            lost: self.loss(state.lagged),
        }
    }

    pub(super) fn pop(&self) -> Option<M> {
        self.refreshed(State::pop)
    }

    pub(super) fn len(&self) -> usize {
        self.refreshed(|state| state.messages.len())
    }

    pub(super) fn lagged(&self) -> u64 {
        self.lock().lagged
    }

    /// Waits for a message until `timeout` (`None`: forever). Returns `None` after that, or once closed and empty.
    pub(super) fn wait(&self, timeout: Option<Duration>) -> Option<M> {
        let deadline = timeout.and_then(|timeout| Instant::now().checked_add(timeout));
        let mut state = self.lock();
        loop {
            let dropped = self.refresh(&mut state);
            if let Some(next) = state.ready() {
                drop(state);
                dropped.into_iter().for_each(discard);
                return next;
            }
            if let Some((by, alarm)) = self.by_path.as_ref().zip(state.paths.arm()) {
                drop(state);
                by.wake_at(alarm);
                state = self.lock();
                continue;
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
        let dropped = self.refresh(&mut state);
        if let Some(ready) = state.ready() {
            drop(state);
            dropped.into_iter().for_each(discard);
            return Poll::Ready(ready);
        }
        if state.waker.as_ref().is_some_and(|waker| waker.will_wake(context.waker())) {
            return self.pending(state);
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
        let pending = self.pending(state);
        before.into_iter().for_each(discard);
        pending
    }

    /// Returns that no message is due yet, and has the reader woken when the time of one comes.
    fn pending(&self, mut state: MutexGuard<'_, State<M>>) -> Poll<Option<M>> {
        let alarm = state.paths.arm();
        drop(state);
        if let Some((by, alarm)) = self.by_path.as_ref().zip(alarm) {
            by.wake_at(alarm);
        }
        Poll::Pending
    }

    fn lock(&self) -> MutexGuard<'_, State<M>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M> State<M> {
    /// Returns whether somebody waits for a message.
    fn is_awaited(&self) -> bool {
        self.waiting > 0 || self.waker.is_some()
    }

    fn pop(&mut self) -> Option<M> {
        let Entry { message, bytes } = self.messages.pop_front()?;
        self.bytes -= bytes;
        self.paths.take();
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
