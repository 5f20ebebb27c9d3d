//! The subscribers of one topic, and what else of it does not depend on its payload: that is compiled once, and not for each
//! payload.

use super::any::{DynamicMessage, Tap};
use super::queue::{AnyQueue, Queue};
use super::statistics::{SubscriberStatistics, TopicStatistics};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::Waker;

/// The subscriber list of a topic.
pub(super) struct Subscribers {
    /// Replaced as a whole: a publisher takes a list along and holds no lock while it wakes subscribers, which may
    /// subscribe and unsubscribe on that thread. A queue dropped with its list has been abandoned, and so runs no
    /// user code.
    queues: Queues,
    /// Untyped subscribers.
    taps: Taps,
    closed: bool,
}

/// Queues of the topic's payload.
type Queues = Arc<[Arc<dyn AnyQueue>]>;
type Taps = Arc<[Arc<Queue<DynamicMessage>>]>;

impl Subscribers {
    fn count(&self) -> usize {
        self.queues.len() + self.taps.len()
    }
}

/// The subscribers at one time.
pub(super) struct Listeners {
    pub(super) queues: Queues,
    pub(super) taps: Taps,
}

/// A topic without its payload.
pub(super) struct Hub {
    pub(super) path: &'static str,
    pub(super) published: AtomicU64,
    /// Messages that slow subscribers did not get.
    lost: AtomicU64,
    /// The number of subscribers: read before the lock, so that publishing to nobody costs next to nothing.
    pub(super) listening: AtomicUsize,
    subscribers: Arc<Mutex<Subscribers>>,
    /// Held while a message is written to a journal and enqueued, so that both have the same order.
    pub(super) order: Mutex<()>,
}

impl Hub {
    pub(super) fn new(path: &'static str) -> Self {
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

    /// Adds a subscriber; closes its queue if no more messages will come. Gives the list that it is on.
    pub(super) fn add(&self, queue: Arc<dyn AnyQueue>) -> Weak<Mutex<Subscribers>> {
        let mut subscribers = lock(&self.subscribers);
        if subscribers.closed {
            drop(subscribers);
            // Nobody waits for it yet.
            drop(queue.close());
        } else {
            subscribers.queues = subscribers.queues.iter().cloned().chain([queue]).collect();
            self.listening.store(subscribers.count(), Ordering::Release);
        }
        Arc::downgrade(&self.subscribers)
    }

    pub(super) fn tap(&self, tap: &Tap) {
        let mut subscribers = lock(&self.subscribers);
        if !subscribers.closed {
            // Dropped ones are also removed here: nothing may ever be published at this topic.
            subscribers.taps = live(&subscribers.taps).chain([&tap.0]).map(Arc::clone).collect();
            self.listening.store(subscribers.count(), Ordering::Release);
        }
    }

    /// The tasks to wake.
    pub(super) fn close(&self) -> Vec<Waker> {
        let mut subscribers = lock(&self.subscribers);
        subscribers.closed = true;
        subscribers.taps = Arc::new([]);
        let queues = std::mem::replace(&mut subscribers.queues, Arc::new([]));
        self.listening.store(0, Ordering::Release);
        drop(subscribers);
        queues.iter().filter_map(|queue| queue.close()).collect()
    }

    /// The current subscribers.
    pub(super) fn listeners(&self) -> Listeners {
        let mut subscribers = lock(&self.subscribers);
        if subscribers.taps.iter().any(|tap| tap.is_abandoned()) {
            subscribers.taps = live(&subscribers.taps).map(Arc::clone).collect();
        }
        // Dropped subscriptions have removed themselves from the list; the count is updated here.
        self.listening.store(subscribers.count(), Ordering::Release);
        Listeners { queues: Arc::clone(&subscribers.queues), taps: Arc::clone(&subscribers.taps) }
    }

    /// Whether these are still all of them.
    pub(super) fn has_still(&self, listeners: &Listeners) -> bool {
        let subscribers = lock(&self.subscribers);
        Arc::ptr_eq(&listeners.queues, &subscribers.queues) && Arc::ptr_eq(&listeners.taps, &subscribers.taps)
    }

    pub(super) fn count_lost(&self, lost: u64) {
        if lost > 0 {
            self.lost.fetch_add(lost, Ordering::Relaxed);
        }
    }

    pub(super) fn subscribers(&self) -> Vec<SubscriberStatistics> {
        let subscribers = lock(&self.subscribers);
        let typed = subscribers.queues.iter().map(|queue| queue.statistics());
        let untyped =
            live(&subscribers.taps).map(|tap| SubscriberStatistics { is_typed: false, ..tap.statistics() });
        typed.chain(untyped).collect()
    }

    pub(super) fn statistics(&self, payload: &'static str) -> TopicStatistics {
        TopicStatistics {
            path: self.path,
            payload,
            published: self.published.load(Ordering::Relaxed),
            lost: self.lost.load(Ordering::Relaxed),
            subscribers: self.subscribers().len(),
        }
    }
}

/// The queues whose readers are not gone.
fn live(taps: &Taps) -> impl Iterator<Item = &Arc<Queue<DynamicMessage>>> {
    taps.iter().filter(|tap| !tap.is_abandoned())
}

/// Removes the queue at that address from the list of its topic, if the topic still exists.
pub(super) fn leave(topic: &Weak<Mutex<Subscribers>>, queue: *const ()) {
    if let Some(subscribers) = topic.upgrade() {
        let mut subscribers = lock(&subscribers);
        let others = subscribers.queues.iter().filter(|other| Arc::as_ptr(other).cast() != queue).cloned();
        subscribers.queues = others.collect();
    }
}

fn lock(subscribers: &Mutex<Subscribers>) -> MutexGuard<'_, Subscribers> {
    subscribers.lock().unwrap_or_else(PoisonError::into_inner)
}
