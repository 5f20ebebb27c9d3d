//! The subscribers of one topic.

use super::any::DynamicMessage;
use super::queue::Queue;
use crate::message::Stamped;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// The subscriber list of a topic.
pub(super) struct Subscribers<T> {
    /// Replaced as a whole: a publisher takes a list along and holds no lock while it wakes subscribers, which may
    /// subscribe and unsubscribe on that thread. A queue dropped with its list has been abandoned, and so runs no
    /// user code.
    pub(super) queues: Arc<[Arc<Queue<Stamped<T>>>]>,
    /// Untyped subscribers.
    pub(super) taps: Arc<[Arc<Queue<DynamicMessage>>]>,
    pub(super) closed: bool,
}

impl<T> Subscribers<T> {
    pub(super) fn count(&self) -> usize {
        self.queues.len() + self.taps.len()
    }
}

/// Removes `queue` from the list of its topic, if the topic still exists.
pub(super) fn leave<T>(topic: &Weak<Mutex<Subscribers<T>>>, queue: &Arc<Queue<Stamped<T>>>) {
    if let Some(subscribers) = topic.upgrade() {
        let mut subscribers = lock(&subscribers);
        let others = subscribers.queues.iter().filter(|other| !Arc::ptr_eq(other, queue)).map(Arc::clone);
        subscribers.queues = others.collect();
    }
}

pub(super) fn lock<T>(subscribers: &Mutex<Subscribers<T>>) -> MutexGuard<'_, Subscribers<T>> {
    subscribers.lock().unwrap_or_else(PoisonError::into_inner)
}
