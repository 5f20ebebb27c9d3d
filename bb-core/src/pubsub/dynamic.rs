//! Messages of any payload, by path: for loggers, dashboards, recorders.

use super::any::{AnyTopic, DynamicMessage, Tap};
use super::delivery::Delivery;
use super::queue::Queue;
use super::select::{Payloads, Select};
use super::timer::Timer;
use super::unmatched::{Unmatched, unmatched};
use crate::message::Schema;
use crate::message::codec::Layouts;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

/// The messages of all selected publishers, in the order in which they were published, including publishers created
/// later at run time. Dropping it unsubscribes.
#[derive(Debug)]
pub struct DynamicSubscription {
    queue: Arc<Queue<DynamicMessage>>,
    paths: Vec<&'static str>,
    layouts: Vec<Layouts>,
    unmatched: Vec<Unmatched>,
}

impl DynamicSubscription {
    /// Subscribes to the selected `topics` whose payload is one of `payloads`. Parts of the selection that match none
    /// of them are logged as a warning, and kept in [`unmatched`](Self::unmatched). (A highest rate needs the clock of a robot, and is
    /// ignored here.)
    pub fn new<'a, 'b>(
        topics: impl IntoIterator<Item = &'a dyn AnyTopic>,
        select: Select<'_>,
        payloads: impl Into<Payloads<'b>>,
        delivery: impl Into<Delivery>,
    ) -> Self {
        let topics: Vec<_> = topics.into_iter().collect();
        let subscription = Self::among(&topics, select, &payloads.into(), delivery.into(), &Timer::default());
        subscription.warn();
        subscription
    }

    /// Selects as above, without the log.
    pub(super) fn among(
        topics: &[&dyn AnyTopic],
        select: Select<'_>,
        payloads: &Payloads<'_>,
        delivery: Delivery,
        timer: &Timer,
    ) -> Self {
        let queue = Queue::shared(delivery, timer);
        let mut paths = Vec::new();
        let mut layouts = Vec::new();
        for topic in topics {
            if select.includes(topic.path()) && payloads.includes(topic.payload_name()) {
                topic.tap(&Tap(Arc::clone(&queue)));
                paths.push(topic.path());
                layouts.push(topic.layouts());
            }
        }
        let unmatched = unmatched(topics, select, payloads);
        Self { queue, paths, layouts, unmatched }
    }

    /// Logs unmatched parts. No lock may be held: it runs the user's `tracing` subscriber.
    pub(super) fn warn(&self) {
        for unmatched in &self.unmatched {
            tracing::warn!("{unmatched}");
        }
    }

    pub(super) fn tap(&self) -> Tap {
        Tap(Arc::clone(&self.queue))
    }

    /// The paths it listened to when it was created. It also listens to selected paths created later at run time.
    pub fn paths(&self) -> &[&'static str] {
        &self.paths
    }

    /// The definitions of the topics it listened to when it was created, by path: what a recorder would write.
    pub fn schemas(&self) -> impl Iterator<Item = (&'static str, Vec<Schema>)> + '_ {
        self.paths.iter().zip(&self.layouts).map(|(path, layouts)| (*path, layouts.schemas()))
    }

    /// The parts of its selection that matched nothing when it was created, each with the nearest name.
    pub fn unmatched(&self) -> &[Unmatched] {
        &self.unmatched
    }

    /// The oldest waiting message, if any.
    pub fn try_recv(&self) -> Option<DynamicMessage> {
        self.queue.pop()
    }

    /// Waits for the next message, `timeout` at most; returns `None` after that. (It does not end by itself when the
    /// robot stops, since its publishers stop one by one.)
    pub fn recv_timeout(&self, timeout: Duration) -> Option<DynamicMessage> {
        self.queue.wait(Some(timeout))
    }

    /// Awaits the next message, on any executor. One task at a time may await a subscription. (It does not end by itself
    /// when the robot stops.)
    pub fn recv_async(&mut self) -> RecvDynamic<'_> {
        RecvDynamic(self)
    }

    /// The messages waiting now; those that arrive meanwhile are left.
    pub fn drain(&self) -> impl Iterator<Item = DynamicMessage> + '_ {
        (0..self.queue.len()).map_while(|_| self.try_recv())
    }

    /// Returns the number of messages that wait now.
    pub fn waiting(&self) -> usize {
        self.queue.len()
    }

    /// Returns the number of messages that this subscriber did not get, since newer ones have taken their room.
    pub fn lagged(&self) -> u64 {
        self.queue.lagged()
    }
}

/// The future of [`DynamicSubscription::recv_async`].
#[derive(Debug)]
pub struct RecvDynamic<'a>(&'a mut DynamicSubscription);

impl Future for RecvDynamic<'_> {
    type Output = Option<DynamicMessage>;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        self.0.queue.poll(context)
    }
}

impl Drop for DynamicSubscription {
    fn drop(&mut self) {
        // Its topics release it at their next message.
        self.queue.abandon();
    }
}

#[cfg(test)]
mod tests {
    use super::super::Overflow;
    use super::*;

    #[test]
    fn a_silent_topic_forgets_those_who_have_left() {
        let topic = super::super::Topic::<crate::payload::JointState>::new("sensor/arm/encoder");
        let listen =
            || DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, Overflow::KeepLatest);
        let left: Vec<_> = (0..100).map(|_| Arc::downgrade(&listen().queue)).collect();
        assert!(left.iter().filter(|queue| queue.strong_count() > 0).count() <= 16);
    }
}
