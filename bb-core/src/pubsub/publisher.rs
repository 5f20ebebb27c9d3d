//! Publishing at a path that the robot does not declare.

use super::{AnyTopic as _, Topic};
use crate::message::{Payload, Stamp, Stamped};
use std::fmt;
use std::sync::Arc;

/// Publishes payloads of type `T` at a path that the robot does not declare: see [`Bus::publisher`](crate::Bus::publisher).
/// Clones publish at the same path. The path remains when the last of them is dropped.
pub struct Publisher<T> {
    topic: Arc<Topic<T>>,
    stamp: Arc<dyn Fn() -> Stamp + Send + Sync>,
}

impl<T: Payload> Publisher<T> {
    /// `stamp` gives the stamp of a payload that is published now.
    pub(crate) fn new(topic: Arc<Topic<T>>, stamp: impl Fn() -> Stamp + Send + Sync + 'static) -> Self {
        Self { topic, stamp: Arc::new(stamp) }
    }

    /// Publishes a payload measured now, in no frame. In a command, now is the time at which commands proceed.
    pub fn publish(&self, payload: T) {
        self.topic.publish(&(self.stamp)().message(payload));
    }

    /// Publishes a message with the stamp that it has: one that comes from elsewhere and is passed on.
    pub fn forward(&self, message: &Stamped<T>) {
        self.topic.publish(message);
    }

    /// Its path.
    pub fn path(&self) -> &'static str {
        self.topic.path()
    }
}

impl<T> Clone for Publisher<T> {
    fn clone(&self) -> Self {
        Self { topic: Arc::clone(&self.topic), stamp: Arc::clone(&self.stamp) }
    }
}

impl<T: Payload> fmt::Debug for Publisher<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Publisher").field("path", &self.path()).finish_non_exhaustive()
    }
}
