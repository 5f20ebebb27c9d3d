//! The subscriber's end.

use super::queue::Queue;
use super::unmatched::Unmatched;
use crate::message::Stamped;
use std::fmt;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

/// The messages of one publisher, in order. Dropping it unsubscribes.
pub struct Subscription<T> {
    path: &'static str,
    queue: Arc<Queue<Stamped<T>>>,
    unmatched: Option<Box<Unmatched>>,
}

impl<T> Subscription<T> {
    pub(super) fn new(path: &'static str, queue: Arc<Queue<Stamped<T>>>) -> Self {
        Self { path, queue, unmatched: None }
    }

    /// Notes and logs that nothing publishes at its path. No lock may be held: it runs the user's `tracing` subscriber.
    pub(crate) fn noting(mut self, unmatched: Unmatched) -> Self {
        tracing::warn!("{unmatched}");
        self.unmatched = Some(Box::new(unmatched));
        self
    }

    /// Says so, with the nearest path, if nothing published at its path when it was created. It is a path of your own, whose publisher may
    /// come later, or it is misspelt.
    pub fn unmatched(&self) -> Option<&Unmatched> {
        self.unmatched.as_deref()
    }

    /// Returns the subscription to a path whose publisher must exist.
    ///
    /// # Errors
    /// Nothing published there when it was created.
    pub fn matched(mut self) -> Result<Self, Unmatched> {
        match self.unmatched.take() {
            Some(unmatched) => Err(*unmatched),
            None => Ok(self),
        }
    }

    /// The path of the publisher.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// The oldest waiting message, if any.
    pub fn try_recv(&self) -> Option<Stamped<T>> {
        self.queue.pop()
    }

    /// Waits for the next message. Returns `None` once the robot has stopped and all messages are read.
    pub fn recv(&self) -> Option<Stamped<T>> {
        self.queue.wait(None)
    }

    /// Waits for the next message, at most `timeout`. Returns `None` after that, or once the robot has stopped.
    pub fn recv_timeout(&self, timeout: Duration) -> Option<Stamped<T>> {
        self.queue.wait(Some(timeout))
    }

    /// Awaits the next message, on any executor; `None` once the robot has stopped and all messages are read. One task
    /// at a time may await a subscription.
    pub fn recv_async(&mut self) -> RecvAsync<'_, T> {
        RecvAsync(self)
    }

    /// Takes the messages waiting now; those that arrive meanwhile stay.
    pub fn drain(&self) -> impl Iterator<Item = Stamped<T>> + '_ {
        (0..self.queue.len()).map_while(|_| self.try_recv())
    }

    /// Returns the number of messages that this subscriber did not get, since newer ones have taken their room.
    pub fn lagged(&self) -> u64 {
        self.queue.lagged()
    }
}

impl<T> Drop for Subscription<T> {
    fn drop(&mut self) {
        // Its topic releases it at its next message.
        self.queue.abandon();
    }
}

impl<T> fmt::Debug for Subscription<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Subscription").field("path", &self.path).finish_non_exhaustive()
    }
}

/// The future of [`Subscription::recv_async`].
#[derive(Debug)]
pub struct RecvAsync<'a, T>(&'a mut Subscription<T>);

impl<T> Future for RecvAsync<'_, T> {
    type Output = Option<Stamped<T>>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        self.0.queue.poll(context)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{AnyTopic, Overflow, Topic};
    use crate::message::Stamped;
    use crate::payload::JointState;
    use crate::time::MonotonicTime;
    use std::time::Duration;

    fn message(position: f64) -> Stamped<JointState> {
        Stamped::new(MonotonicTime::ZERO, JointState { position, velocity: None, effort: None })
    }

    #[test]
    fn a_slow_subscriber_loses_the_oldest_and_knows_how_many() {
        let topic = Topic::new("sensor/arm/encoder");
        let slow = topic.subscribe(Overflow::DropOldest { capacity: 2 });
        let latest = topic.subscribe(Overflow::KeepLatest);
        for position in [1.0, 2.0, 3.0, 4.0] {
            topic.publish(&message(position));
        }
        assert_eq!(slow.drain().map(|message| message.position).collect::<Vec<_>>(), [3.0, 4.0]);
        assert_eq!((slow.lagged(), latest.lagged()), (2, 3));
        assert_eq!(topic.statistics().lost, 2, "who keeps the newest alone loses nothing");
        assert_eq!(latest.try_recv().map(|message| message.position), Some(4.0));
    }

    #[test]
    fn dropping_a_subscription_unsubscribes() {
        let topic = Topic::new("sensor/arm/encoder");
        let (first, second) = (topic.subscribe(Overflow::default()), topic.subscribe(Overflow::default()));
        drop(first);
        topic.publish(&message(1.0));
        assert_eq!(topic.statistics().subscribers, 1);
        assert_eq!(second.drain().count(), 1);
        drop(second);
        topic.publish(&message(2.0));
        assert_eq!((topic.statistics().subscribers, topic.statistics().published), (0, 2));
    }

    #[test]
    fn a_closed_topic_hands_out_what_waits_and_then_none() {
        let topic = Topic::new("sensor/arm/encoder");
        let subscription = topic.subscribe(Overflow::default());
        topic.publish(&message(1.0));
        drop(topic.close());
        assert!(subscription.recv().is_some());
        assert!(subscription.recv().is_none());
        assert!(topic.subscribe(Overflow::default()).recv().is_none());
    }

    #[test]
    fn waiting_ends_with_the_message_or_with_the_time() {
        let topic = Topic::new("sensor/arm/encoder");
        let subscription = topic.subscribe(Overflow::default());
        assert!(subscription.recv_timeout(Duration::from_millis(1)).is_none());
        std::thread::scope(|scope| {
            scope.spawn(|| topic.publish(&message(7.0)));
            assert_eq!(subscription.recv().map(|message| message.position), Some(7.0));
        });
    }
}
