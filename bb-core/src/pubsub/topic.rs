//! The publisher's end of a topic.

use super::any::DynamicMessage;
use super::queue::{Overflow, Queue, counted_bytes};
use super::subscribers::{Subscribers, lock};
use super::subscription::Subscription;
use super::wakers::{Wakers, wake};
use crate::message::Payload;
use crate::message::{Panic, Stamped, copied};
use std::fmt;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::Waker;

/// Distributes the messages of one publisher to its subscribers. Dropping it tells them that no more will come.
pub struct Topic<T> {
    pub(super) path: &'static str,
    pub(super) published: AtomicU64,
    /// Messages that slow subscribers did not get.
    pub(super) lost: AtomicU64,
    /// The number of subscribers: read before the lock, so that publishing to nobody costs next to nothing.
    pub(super) listening: AtomicUsize,
    pub(super) subscribers: Arc<Mutex<Subscribers<T>>>,
    /// Held while a message is written to a journal and enqueued, so that both have the same order.
    order: Mutex<()>,
}

impl<T> Topic<T> {
    /// A topic without subscribers.
    pub fn new(path: &'static str) -> Self {
        let subscribers = Subscribers { queues: Arc::new([]), taps: Arc::new([]), closed: false };
        Self {
            path,
            published: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            listening: AtomicUsize::new(0),
            subscribers: Arc::new(Mutex::new(subscribers)),
            order: Mutex::default(),
        }
    }

    /// Subscribes from now on, until the subscription is dropped.
    pub fn subscribe(&self, overflow: Overflow) -> Subscription<T> {
        let queue = Arc::new(Queue::new(overflow));
        let mut subscribers = lock(&self.subscribers);
        if subscribers.closed {
            drop(subscribers);
            // Nobody waits for it yet.
            drop(queue.close());
        } else {
            subscribers.queues = subscribers.queues.iter().chain([&queue]).map(Arc::clone).collect();
            self.listening.store(subscribers.count(), Ordering::Release);
        }
        Subscription::new(self.path, queue, Arc::downgrade(&self.subscribers))
    }

    /// The tasks to wake.
    pub(super) fn close_all(&self) -> Vec<Waker> {
        let mut subscribers = lock(&self.subscribers);
        subscribers.closed = true;
        subscribers.taps = Arc::new([]);
        let queues = std::mem::replace(&mut subscribers.queues, Arc::new([]));
        self.listening.store(0, Ordering::Release);
        drop(subscribers);
        queues.iter().filter_map(|queue| queue.close()).collect()
    }
}

impl<T: Payload> Topic<T> {
    /// Hands a clone of `message` to every subscriber.
    #[inline]
    pub fn publish(&self, message: &Stamped<T>) {
        self.published.fetch_add(1, Ordering::Relaxed);
        self.hand_out(message);
    }

    /// The same; a panic of the payload's `Clone` is kept in `panic`, unless there is one already.
    #[inline]
    pub(crate) fn publish_contained(&self, message: &Stamped<T>, panic: &mut Option<Panic>) {
        self.published.fetch_add(1, Ordering::Relaxed);
        if self.is_listened_to() {
            self.deliver_and_wake(message, panic);
        }
    }

    /// The same for a publisher that is alone, as an estimator is in its island: it need not fear that somebody else counts
    /// at the same time.
    #[inline]
    pub fn publish_alone(&self, message: &Stamped<T>) {
        self.count_alone();
        self.hand_out(message);
    }

    /// The same for a message without subscribers.
    #[inline]
    pub(crate) fn count_alone(&self) {
        self.published.store(self.published.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    /// Whether there are subscribers.
    #[inline]
    pub(crate) fn is_listened_to(&self) -> bool {
        self.listening.load(Ordering::Acquire) > 0
    }

    /// The same for one of several publishers, of a message that `write` writes into a journal: subscribers receive messages
    /// in the order of their lines. What `write` gives is returned. A panic of the payload's `Clone` is kept in `panic`, unless
    /// there is one already.
    pub(crate) fn publish_as_written<L>(
        &self,
        message: &Stamped<T>,
        panic: &mut Option<Panic>,
        write: impl FnOnce() -> L,
    ) -> L {
        if self.listening.load(Ordering::Acquire) == 0 {
            let line = write();
            // A subscription that begins meanwhile does not get it: it might already have received one with a later
            // line.
            self.published.fetch_add(1, Ordering::Relaxed);
            return line;
        }
        let mut wakers = Wakers::default();
        // Copies are made before: the payload's `clone` is user code, and another publisher must not wait for it.
        let mut copies = self.copies(message, panic);
        loop {
            let order = self.order.lock().unwrap_or_else(PoisonError::into_inner);
            if !self.has_still(&copies.listeners) {
                drop(order);
                copies = self.copies(message, panic);
                continue;
            }
            let line = write();
            self.published.fetch_add(1, Ordering::Relaxed);
            self.enqueue(copies, &mut wakers);
            drop(order);
            wakers.run();
            return line;
        }
    }

    /// Only enqueues `message`: what is to be woken and dropped goes to `wakers`. For a publisher that holds a lock. No user's
    /// code runs here but the payload's `clone`, and that only if somebody listens; its panic is kept in `panic`, unless there is
    /// one already.
    #[inline]
    pub(crate) fn publish_deferred(&self, message: &Stamped<T>, wakers: &mut Wakers, panic: &mut Option<Panic>) {
        self.published.fetch_add(1, Ordering::Relaxed);
        if self.listening.load(Ordering::Acquire) > 0 {
            self.deliver(message, wakers, panic);
        }
    }

    #[inline]
    fn hand_out(&self, message: &Stamped<T>) {
        if self.is_listened_to() {
            let mut panic = None;
            self.deliver_and_wake(message, &mut panic);
            if let Some(panic) = panic {
                resume_unwind(panic);
            }
        }
    }

    #[cold]
    fn deliver_and_wake(&self, message: &Stamped<T>, panic: &mut Option<Panic>) {
        let mut wakers = Wakers::dropping_at_once();
        self.deliver(message, &mut wakers, panic);
        wakers.run();
    }

    /// Keeps a panic of the payload's `Clone`, if there is none yet; the message is handed to everybody all the same.
    #[cold]
    fn deliver(&self, message: &Stamped<T>, wakers: &mut Wakers, panic: &mut Option<Panic>) {
        let Listeners { queues, taps } = self.listeners();
        let bytes = counted_bytes(message);
        let mut lost: u64 = queues
            .iter()
            .map(|queue| copied(message, panic).map_or(1, |copy| queue.push(copy, bytes, wakers)))
            .sum();
        if !taps.is_empty() {
            let copy = copied(message, panic).map(|copy| DynamicMessage::of(self.path, copy));
            lost += copy.map_or(taps.len() as u64, |copy| tap_all(&taps, copy, bytes, wakers));
        }
        self.count_lost(lost);
    }

    /// The current subscribers.
    fn listeners(&self) -> Listeners<T> {
        let mut subscribers = lock(&self.subscribers);
        if subscribers.taps.iter().any(|tap| tap.is_abandoned()) {
            subscribers.taps = subscribers.taps.iter().filter(|tap| !tap.is_abandoned()).map(Arc::clone).collect();
        }
        // Dropped subscriptions have removed themselves from the list; the count is updated here.
        self.listening.store(subscribers.count(), Ordering::Release);
        Listeners { queues: Arc::clone(&subscribers.queues), taps: Arc::clone(&subscribers.taps) }
    }

    fn has_still(&self, listeners: &Listeners<T>) -> bool {
        let subscribers = lock(&self.subscribers);
        Arc::ptr_eq(&listeners.queues, &subscribers.queues) && Arc::ptr_eq(&listeners.taps, &subscribers.taps)
    }

    fn copies(&self, message: &Stamped<T>, panic: &mut Option<Panic>) -> Copies<T> {
        let listeners = self.listeners();
        let mut typed = listeners.queues.iter().map(|_| copied(message, panic));
        let (first, more) = (typed.next().flatten(), typed.collect());
        let untyped = if listeners.taps.is_empty() { None } else { copied(message, panic) };
        let untyped = untyped.map(|copy| DynamicMessage::of(self.path, copy));
        Copies { bytes: counted_bytes(message), first, more, untyped, listeners }
    }

    /// Hands out copies; runs no code of the payload.
    fn enqueue(&self, copies: Copies<T>, wakers: &mut Wakers) {
        let Copies { listeners, first, more, untyped, bytes } = copies;
        let typed = listeners.queues.iter().zip(std::iter::once(first).chain(more));
        let mut lost: u64 = typed.map(|(queue, copy)| copy.map_or(1, |copy| queue.push(copy, bytes, wakers))).sum();
        lost += match untyped {
            Some(copy) => tap_all(&listeners.taps, copy, bytes, wakers),
            None => listeners.taps.len() as u64,
        };
        self.count_lost(lost);
    }

    fn count_lost(&self, lost: u64) {
        if lost > 0 {
            self.lost.fetch_add(lost, Ordering::Relaxed);
        }
    }
}

/// The subscribers at one time.
struct Listeners<T> {
    queues: Arc<[Arc<Queue<Stamped<T>>>]>,
    taps: Arc<[Arc<Queue<DynamicMessage>>]>,
}

/// A copy of the message for each of them.
struct Copies<T> {
    listeners: Listeners<T>,
    /// One subscriber alone needs no allocation. None of a message that cannot be copied.
    first: Option<Stamped<T>>,
    more: Vec<Option<Stamped<T>>>,
    untyped: Option<DynamicMessage>,
    bytes: usize,
}

fn tap_all(taps: &[Arc<Queue<DynamicMessage>>], message: DynamicMessage, bytes: usize, wakers: &mut Wakers) -> u64 {
    let Some((last, others)) = taps.split_last() else { return 0 };
    let lost: u64 = others.iter().map(|tap| tap.push(message.clone(), bytes, wakers)).sum();
    lost + last.push(message, bytes, wakers)
}

impl<T> Drop for Topic<T> {
    fn drop(&mut self) {
        self.close_all().into_iter().for_each(wake);
    }
}

impl<T> fmt::Debug for Topic<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Topic").field("path", &self.path).finish_non_exhaustive()
    }
}
