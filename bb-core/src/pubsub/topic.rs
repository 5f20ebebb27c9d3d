//! One publisher's end: who listens to it.

use super::queue::Queue;
use super::{Overflow, Subscription};
use crate::Payload;
use crate::message::Stamped;
use std::fmt;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Where the messages of one publisher are subscribed to.
pub struct Topic<T> {
    path: &'static str,
    published: AtomicU64,
    /// How many listen: read before the lock, so that publishing to nobody costs next to nothing.
    listening: AtomicUsize,
    subscribers: Arc<Mutex<Subscribers<T>>>,
}

pub(super) struct Subscribers<T> {
    queues: Vec<Arc<Queue<Stamped<T>>>>,
    closed: bool,
}

impl<T: Payload> Topic<T> {
    /// A topic that nobody listens to yet.
    pub fn new(path: &'static str) -> Self {
        let subscribers = Subscribers { queues: Vec::new(), closed: false };
        Self {
            path,
            published: AtomicU64::new(0),
            listening: AtomicUsize::new(0),
            subscribers: Arc::new(Mutex::new(subscribers)),
        }
    }

    /// Hands a clone of `message` to everybody who listens.
    #[inline]
    pub fn publish(&self, message: &Stamped<T>) {
        self.published.fetch_add(1, Ordering::Relaxed);
        if self.listening.load(Ordering::Acquire) > 0 {
            self.deliver(message);
        }
    }

    fn deliver(&self, message: &Stamped<T>) {
        let subscribers = self.lock();
        for queue in &subscribers.queues {
            queue.push(message.clone());
        }
        // Subscriptions that were dropped have left the list by themselves; here the count follows it.
        self.listening.store(subscribers.queues.len(), Ordering::Release);
    }

    /// Listens from now on, until the subscription is dropped.
    pub fn subscribe(&self, overflow: Overflow) -> Subscription<T> {
        let queue = Arc::new(Queue::new(overflow));
        let mut subscribers = self.lock();
        if subscribers.closed {
            queue.close();
        } else {
            subscribers.queues.push(Arc::clone(&queue));
            self.listening.store(subscribers.queues.len(), Ordering::Release);
        }
        Subscription::new(self.path, queue, Arc::downgrade(&self.subscribers))
    }

    fn lock(&self) -> MutexGuard<'_, Subscribers<T>> {
        lock(&self.subscribers)
    }
}

/// Takes `queue` off the list of its topic, if that is still there.
pub(super) fn leave<T>(topic: &Weak<Mutex<Subscribers<T>>>, queue: &Arc<Queue<Stamped<T>>>) {
    if let Some(subscribers) = topic.upgrade() {
        lock(&subscribers).queues.retain(|other| !Arc::ptr_eq(other, queue));
    }
}

fn lock<T>(subscribers: &Mutex<Subscribers<T>>) -> MutexGuard<'_, Subscribers<T>> {
    subscribers.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<T> fmt::Debug for Topic<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Topic").field("path", &self.path).finish_non_exhaustive()
    }
}

/// What all topics have in common.
pub trait AnyTopic {
    /// What it has counted.
    fn statistics(&self) -> TopicStatistics;
    /// Tells all subscribers that no more will come.
    fn close(&self);
}

impl<T: Payload> AnyTopic for Topic<T> {
    fn statistics(&self) -> TopicStatistics {
        TopicStatistics {
            path: self.path,
            payload: T::NAME,
            published: self.published.load(Ordering::Relaxed),
            subscribers: self.lock().queues.len(),
        }
    }

    fn close(&self) {
        let mut subscribers = self.lock();
        subscribers.closed = true;
        for queue in subscribers.queues.drain(..) {
            queue.close();
        }
        self.listening.store(0, Ordering::Release);
    }
}

/// What a topic has counted since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopicStatistics {
    /// Its path.
    pub path: &'static str,
    /// The name of its payload's type.
    pub payload: &'static str,
    /// Messages published.
    pub published: u64,
    /// Subscriptions that listen now.
    pub subscribers: usize,
}
