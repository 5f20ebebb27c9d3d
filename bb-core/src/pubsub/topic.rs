//! The publisher's end of a topic.

use super::any::DynamicMessage;
use super::bound::counted_bytes;
use super::delivery::Delivery;
use super::queue::{AnyQueue, Queue};
use super::subscribers::{Hub, Listeners};
use super::subscription::Subscription;
use super::timer::Timer;
use super::wakers::Wakers;
use crate::fault::wake;
use crate::message::{Payload, Stamped};
use std::any::Any;
use std::fmt;
use std::marker::PhantomData;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

/// Distributes the messages of one publisher to its subscribers. Dropping it tells them that no more will come.
pub struct Topic<T> {
    pub(super) hub: Hub,
    payload: PhantomData<fn(T)>,
}

impl<T> Topic<T> {
    /// A topic without subscribers.
    pub fn new(path: &'static str) -> Self {
        Self { hub: Hub::new(path), payload: PhantomData }
    }
}

impl<T: Payload> Topic<T> {
    /// Subscribes from now on, until the subscription is dropped. (A highest rate needs the clock of a robot, and is ignored here.)
    pub fn subscribe(&self, delivery: impl Into<Delivery>) -> Subscription<T> {
        self.subscribe_on(delivery.into(), &Timer::default())
    }

    /// Subscribes on the clock of a run.
    pub(crate) fn subscribe_on(&self, delivery: Delivery, timer: &Timer) -> Subscription<T> {
        let queue = Queue::shared(delivery, timer);
        self.hub.add(Arc::clone(&queue) as Arc<dyn AnyQueue>);
        Subscription::new(self.hub.path, queue)
    }

    /// Hands a clone of `message` to every subscriber. If the payload's `Clone` panics, those that come after do not get it.
    #[inline]
    pub fn publish(&self, message: &Stamped<T>) {
        self.hub.published.fetch_add(1, Ordering::Relaxed);
        if self.is_listened_to() {
            self.deliver_and_wake(message);
        }
    }

    /// Counts a message without subscribers, of a publisher that is alone, as an estimator is in its island: nobody else counts at the
    /// same time.
    #[inline]
    pub(crate) fn count_alone(&self) {
        self.hub.published.store(self.hub.published.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    /// Returns whether there are subscribers.
    #[inline]
    pub(crate) fn is_listened_to(&self) -> bool {
        self.hub.listening.load(Ordering::Acquire) > 0
    }

    /// Publishes a message that `write` writes into a journal, of one of several publishers: subscribers receive messages in the order
    /// of their lines. What `write` gives is returned.
    pub(crate) fn publish_as_written<L>(&self, message: &Stamped<T>, write: impl FnOnce() -> L) -> L {
        if !self.is_listened_to() {
            let line = write();
            // A subscription that begins meanwhile does not get it: it might already have received one with a later
            // line.
            self.hub.published.fetch_add(1, Ordering::Relaxed);
            return line;
        }
        let mut wakers = Wakers::default();
        // Copies are made before: the payload's `clone` is user code, and another publisher must not wait for it.
        let mut copies = self.copies(message);
        loop {
            let order = self.hub.order.lock().unwrap_or_else(PoisonError::into_inner);
            if !self.hub.has_still(&copies.listeners) {
                drop(order);
                copies = self.copies(message);
                continue;
            }
            let line = write();
            self.hub.published.fetch_add(1, Ordering::Relaxed);
            self.enqueue(copies, &mut wakers);
            drop(order);
            self.hub.count_panics(wakers.run());
            return line;
        }
    }

    /// Enqueues `message` only: what is to be woken and dropped goes to `wakers`. For a publisher that holds a lock. No user's code
    /// runs here but the payload's `clone`, and that only if somebody listens.
    #[inline]
    pub(crate) fn publish_deferred(&self, message: &Stamped<T>, wakers: &mut Wakers) {
        self.hub.published.fetch_add(1, Ordering::Relaxed);
        if self.is_listened_to() {
            self.deliver(message, wakers);
        }
    }

    #[cold]
    fn deliver_and_wake(&self, message: &Stamped<T>) {
        let mut wakers = Wakers::dropping_at_once();
        self.deliver(message, &mut wakers);
        self.hub.count_panics(wakers.run());
    }

    #[cold]
    fn deliver(&self, message: &Stamped<T>, wakers: &mut Wakers) {
        let Listeners { queues, taps } = self.hub.listeners();
        let bytes = counted_bytes(message);
        let mut lost = 0;
        for queue in &*queues {
            lost += push(&**queue, self.hub.path, message.clone(), bytes, wakers);
        }
        if !taps.is_empty() {
            lost += tap_all(&taps, DynamicMessage::new(self.hub.path, message), bytes, wakers);
        }
        self.hub.count_lost(lost);
    }

    fn copies(&self, message: &Stamped<T>) -> Copies<T> {
        let listeners = self.hub.listeners();
        let (mut first, mut more) = (None, Vec::new());
        for index in 0..listeners.queues.len() {
            let copy = message.clone();
            if index == 0 {
                first = Some(copy);
            } else {
                more.push(copy);
            }
        }
        let untyped =
            if listeners.taps.is_empty() { None } else { Some(DynamicMessage::new(self.hub.path, message)) };
        Copies { bytes: counted_bytes(message), first, more, untyped, listeners }
    }

    /// Hands out copies; runs no code of the payload.
    fn enqueue(&self, copies: Copies<T>, wakers: &mut Wakers) {
        let Copies { listeners, mut first, more, untyped, bytes } = copies;
        let mut more = more.into_iter();
        let mut lost = 0;
        for queue in &*listeners.queues {
            if let Some(copy) = first.take().or_else(|| more.next()) {
                lost += push(&**queue, self.hub.path, copy, bytes, wakers);
            }
        }
        if let Some(untyped) = untyped {
            lost += tap_all(&listeners.taps, untyped, bytes, wakers);
        }
        self.hub.count_lost(lost);
    }
}

/// A copy of the message for each of them.
struct Copies<T> {
    listeners: Listeners,
    /// One subscriber alone needs no allocation.
    first: Option<Stamped<T>>,
    more: Vec<Stamped<T>>,
    untyped: Option<DynamicMessage>,
    bytes: usize,
}

/// Adds a message to a queue of its payload. Returns how many were lost.
fn push<T: Payload>(
    queue: &dyn AnyQueue,
    path: &'static str,
    message: Stamped<T>,
    bytes: usize,
    wakers: &mut Wakers,
) -> u64 {
    let queue: Option<&Queue<Stamped<T>>> = (queue as &dyn Any).downcast_ref();
    queue.map_or(0, |queue| queue.push(path, message, bytes, wakers))
}

/// Adds a message to all of them. Returns how many were lost.
fn tap_all(taps: &[Arc<Queue<DynamicMessage>>], message: DynamicMessage, bytes: usize, wakers: &mut Wakers) -> u64 {
    let Some((last, others)) = taps.split_last() else { return 0 };
    let path = message.path();
    let lost: u64 = others.iter().map(|tap| tap.push(path, message.clone(), bytes, wakers)).sum();
    lost + last.push(path, message, bytes, wakers)
}

impl<T> Drop for Topic<T> {
    fn drop(&mut self) {
        for waker in self.hub.close() {
            wake(waker);
        }
    }
}

impl<T> fmt::Debug for Topic<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Topic").field("path", &self.hub.path).finish_non_exhaustive()
    }
}
