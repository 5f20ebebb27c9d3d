//! The subscribers of one topic, and what else of it does not depend on its payload: that is compiled once, and not for each
//! payload.

use super::any::{DynamicMessage, Tap};
use super::queue::{AnyQueue, Queue};
use super::statistics::{SubscriberStatistics, TopicStatistics};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Waker;

/// The subscribers of a topic.
struct Subscribers {
    /// Queues of the topic's payload.
    queues: List<dyn AnyQueue>,
    /// Untyped subscribers.
    taps: List<Queue<DynamicMessage>>,
    closed: bool,
}

impl Subscribers {
    fn count(&self) -> usize {
        self.queues.all.len() + self.taps.all.len()
    }
}

/// The queues of some subscribers. Those whose readers are gone are removed at the next message, or once they are as many as the others:
/// nothing may ever be published at a topic. A queue dropped with its list has been abandoned, and so runs no user code.
struct List<Q: ?Sized> {
    /// A publisher takes the list along and holds no lock while it wakes subscribers, which may subscribe and unsubscribe on that
    /// thread. So it is copied if it changes meanwhile.
    all: Snapshot<Q>,
    /// Number of subscribers at the next cleaning: twice the number left by the last one.
    clean_at: usize,
}

type Snapshot<Q> = Arc<Vec<Arc<Q>>>;

impl<Q: AnyQueue + ?Sized> List<Q> {
    const FEW: usize = 16;

    fn add(&mut self, queue: Arc<Q>) {
        if self.all.len() >= self.clean_at {
            self.clean();
            self.clean_at = (2 * self.all.len()).max(Self::FEW);
        }
        Arc::make_mut(&mut self.all).push(queue);
    }

    fn clean(&mut self) {
        if self.all.iter().any(|queue| queue.is_abandoned()) {
            Arc::make_mut(&mut self.all).retain(|queue| !queue.is_abandoned());
        }
    }

    fn statistics(&self) -> impl Iterator<Item = SubscriberStatistics> {
        self.all.iter().filter(|queue| !queue.is_abandoned()).map(|queue| queue.statistics())
    }
}

impl<Q: ?Sized> Default for List<Q> {
    fn default() -> Self {
        Self { all: Arc::default(), clean_at: 0 }
    }
}

/// The subscribers at one time.
pub(super) struct Listeners {
    pub(super) queues: Snapshot<dyn AnyQueue>,
    pub(super) taps: Snapshot<Queue<DynamicMessage>>,
}

/// A topic without its payload.
pub(super) struct Hub {
    pub(super) path: &'static str,
    pub(super) published: AtomicU64,
    /// Messages that slow subscribers did not get.
    lost: AtomicU64,
    /// Wakers of subscribers that panicked on a publisher's thread.
    panics: AtomicU64,
    /// The number of subscribers: read before the lock, so that publishing to nobody costs next to nothing.
    pub(super) listening: AtomicUsize,
    subscribers: Mutex<Subscribers>,
    /// Held while a message is written to a journal and enqueued, so that both have the same order.
    pub(super) order: Mutex<()>,
}

impl Hub {
    pub(super) fn new(path: &'static str) -> Self {
        let subscribers = Subscribers { queues: List::default(), taps: List::default(), closed: false };
        Self {
            path,
            published: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            panics: AtomicU64::new(0),
            listening: AtomicUsize::new(0),
            subscribers: Mutex::new(subscribers),
            order: Mutex::default(),
        }
    }

    /// Adds a subscriber; closes its queue if no more messages will come.
    pub(super) fn add(&self, queue: Arc<dyn AnyQueue>) {
        let mut subscribers = self.lock();
        if subscribers.closed {
            drop(subscribers);
            // Nobody waits for it yet.
            drop(queue.close());
        } else {
            subscribers.queues.add(queue);
            self.listening.store(subscribers.count(), Ordering::Release);
        }
    }

    pub(super) fn tap(&self, tap: &Tap) {
        let mut subscribers = self.lock();
        if !subscribers.closed {
            subscribers.taps.add(Arc::clone(&tap.0));
            self.listening.store(subscribers.count(), Ordering::Release);
        }
    }

    /// The tasks to wake.
    pub(super) fn close(&self) -> Vec<Waker> {
        let mut subscribers = self.lock();
        subscribers.closed = true;
        subscribers.taps = List::default();
        let queues = std::mem::take(&mut subscribers.queues);
        self.listening.store(0, Ordering::Release);
        drop(subscribers);
        queues.all.iter().filter_map(|queue| queue.close()).collect()
    }

    /// The current subscribers.
    pub(super) fn listeners(&self) -> Listeners {
        let mut subscribers = self.lock();
        subscribers.queues.clean();
        subscribers.taps.clean();
        self.listening.store(subscribers.count(), Ordering::Release);
        Listeners { queues: Arc::clone(&subscribers.queues.all), taps: Arc::clone(&subscribers.taps.all) }
    }

    /// Returns whether these are still all of the listeners.
    pub(super) fn has_still(&self, listeners: &Listeners) -> bool {
        let subscribers = self.lock();
        Arc::ptr_eq(&listeners.queues, &subscribers.queues.all)
            && Arc::ptr_eq(&listeners.taps, &subscribers.taps.all)
    }

    pub(super) fn count_lost(&self, lost: u64) {
        if lost > 0 {
            self.lost.fetch_add(lost, Ordering::Relaxed);
        }
    }

    #[inline]
    pub(super) fn count_panics(&self, panics: u64) {
        if panics > 0 {
            self.panics.fetch_add(panics, Ordering::Relaxed);
        }
    }

    pub(super) fn subscribers(&self) -> Vec<SubscriberStatistics> {
        let subscribers = self.lock();
        let untyped = subscribers.taps.statistics().map(|tap| SubscriberStatistics { is_typed: false, ..tap });
        subscribers.queues.statistics().chain(untyped).collect()
    }

    pub(super) fn statistics(&self, payload: &'static str) -> TopicStatistics {
        TopicStatistics {
            path: self.path,
            payload,
            published: self.published.load(Ordering::Relaxed),
            lost: self.lost.load(Ordering::Relaxed),
            panics: self.panics.load(Ordering::Relaxed),
            subscribers: self.subscribers().len(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Subscribers> {
        self.subscribers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Overflow;
    use super::*;

    #[test]
    fn a_list_grows_in_place_unless_a_publisher_has_it() {
        let queues: Vec<_> = (0..1000).map(|_| Arc::new(Queue::<u8>::new(Overflow::KeepLatest))).collect();
        let mut list = List::default();
        list.add(Arc::clone(&queues[0]));
        let place = Arc::as_ptr(&list.all);
        queues.iter().skip(1).for_each(|queue| list.add(Arc::clone(queue)));
        assert_eq!(Arc::as_ptr(&list.all), place);
        let snapshot = Arc::clone(&list.all);
        list.add(Arc::clone(&queues[0]));
        assert_eq!((snapshot.len(), list.all.len()), (1000, 1001));
        queues.iter().skip(1).for_each(|queue| queue.abandon());
        list.clean();
        assert_eq!((snapshot.len(), list.all.len()), (1000, 2));
    }
}
