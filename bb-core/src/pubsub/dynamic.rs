//! Messages of any payload, by path: for loggers, dashboards, recorders.

use super::queue::Queue;
use super::unmatched::{Unmatched, unmatched};
use super::{AnyTopic, Overflow, Payloads, Registry, Select};
use crate::fault::Fault;
use crate::message::codec::{encode, encode_as_ros, encode_companion, is_exact_as_ros, to_json};
use crate::message::{Payload, Schema, Stamp, Stamped};
use crate::time::WallTime;
use std::any::Any;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// A message whose payload's type is known only to whoever asks for it. Clones are the same message.
#[derive(Clone)]
pub struct DynamicMessage {
    path: &'static str,
    message: Arc<dyn AnyMessage>,
}

trait AnyMessage: Send + Sync {
    fn payload_name(&self) -> &'static str;
    fn stamp(&self) -> Stamp;
    fn as_any(&self) -> &dyn Any;
    fn fmt_payload(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
    fn encode(&self, bytes: &mut Vec<u8>);
    fn schema(&self) -> Schema;
    fn encode_as_ros(&self, bytes: &mut Vec<u8>) -> bool;
    fn ros_schema(&self) -> Option<Schema>;
    fn encode_companion(&self, bytes: &mut Vec<u8>) -> bool;
    fn ros_companion(&self) -> Option<(&'static str, Schema)>;
    fn at_wall_time(&self, time: WallTime) -> Arc<dyn AnyMessage>;
    fn is_exact_as_ros(&self) -> bool;
    fn to_json(&self) -> String;
    fn topic(&self, path: &str, registry: &Registry) -> Result<Arc<dyn AnyTopic>, Fault>;
}

impl<T: Payload> AnyMessage for Stamped<T> {
    fn payload_name(&self) -> &'static str {
        T::NAME
    }
    fn stamp(&self) -> Stamp {
        Stamped::stamp(self)
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn fmt_payload(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.payload, f)
    }
    fn encode(&self, bytes: &mut Vec<u8>) {
        encode(self, bytes);
    }
    fn schema(&self) -> Schema {
        Self::schema()
    }
    fn encode_as_ros(&self, bytes: &mut Vec<u8>) -> bool {
        encode_as_ros(self, bytes)
    }
    fn ros_schema(&self) -> Option<Schema> {
        Self::ros_schema()
    }
    fn encode_companion(&self, bytes: &mut Vec<u8>) -> bool {
        encode_companion(self, bytes)
    }
    fn ros_companion(&self) -> Option<(&'static str, Schema)> {
        Self::ros_companion()
    }
    fn at_wall_time(&self, wall_time: WallTime) -> Arc<dyn AnyMessage> {
        Arc::new(Self { wall_time, ..self.clone() })
    }
    fn is_exact_as_ros(&self) -> bool {
        is_exact_as_ros(self)
    }
    fn to_json(&self) -> String {
        to_json(self)
    }
    fn topic(&self, path: &str, registry: &Registry) -> Result<Arc<dyn AnyTopic>, Fault> {
        Ok(registry.topic::<T>(path)?)
    }
}

impl DynamicMessage {
    pub(crate) fn new<T: Payload>(path: &'static str, message: &Stamped<T>) -> Self {
        Self { path, message: Arc::new(message.clone()) }
    }

    /// The topic at its path, made at run time for its payload.
    pub(crate) fn topic(&self, registry: &Registry) -> Result<Arc<dyn AnyTopic>, Fault> {
        self.message.topic(self.path, registry)
    }

    /// The path it was published at.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// The name of its payload's type.
    pub fn payload_name(&self) -> &'static str {
        self.message.payload_name()
    }

    /// When it was measured, in which frame, and where.
    pub fn stamp(&self) -> Stamp {
        self.message.stamp()
    }

    /// The message, if its payload is a `T`.
    pub fn downcast<T: Payload>(&self) -> Option<&Stamped<T>> {
        self.message.as_any().downcast_ref()
    }

    /// Appends the message with its stamp, bit for bit, as CDR that [`schema`](Self::schema) describes and
    /// [`codec::decode`](crate::message::codec::decode) reads as a `Stamped<T>`.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        self.message.encode(bytes);
    }

    /// What a program that does not know the payload needs to read it.
    pub fn schema(&self) -> Schema {
        self.message.schema()
    }

    /// Appends the message as ROS writes it; false, and nothing, if ROS has no message for its payload. The monotonic
    /// time and the origin are not in it.
    pub fn encode_as_ros(&self, bytes: &mut Vec<u8>) -> bool {
        self.message.encode_as_ros(bytes)
    }

    /// ROS's definition, if ROS has a message for its payload.
    pub fn ros_schema(&self) -> Option<Schema> {
        self.message.ros_schema()
    }

    /// Appends the second message of ROS; false, and nothing, if there is none.
    pub fn encode_companion(&self, bytes: &mut Vec<u8>) -> bool {
        self.message.encode_companion(bytes)
    }

    /// The last part of the topic and the definition of a second message, if ROS has two for its payload.
    pub fn ros_companion(&self) -> Option<(&'static str, Schema)> {
        self.message.ros_companion()
    }

    /// The same with another wall time.
    pub fn at_wall_time(&self, time: WallTime) -> Self {
        Self { path: self.path, message: self.message.at_wall_time(time) }
    }

    /// Whether payload and wall time can be read back from ROS's layout bit for bit.
    pub fn is_exact_as_ros(&self) -> bool {
        self.message.is_exact_as_ros()
    }

    /// The message with its stamp as JSON, for dashboards. See [`codec::to_json`](crate::message::codec::to_json).
    pub fn to_json(&self) -> String {
        self.message.to_json()
    }
}

impl fmt::Debug for DynamicMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} ", self.path, self.stamp().monotonic_time)?;
        self.message.fmt_payload(f)
    }
}

/// The queue of such a subscriber, for a topic to hand messages to.
#[doc(hidden)]
#[derive(Clone, Debug)]
pub struct Tap(pub(super) Arc<Queue<DynamicMessage>>);

/// The messages of all selected publishers, in the order in which they were published: also of those that begin to publish
/// later, at paths made at run time. Dropping it unsubscribes.
#[derive(Debug)]
pub struct DynamicSubscription {
    queue: Arc<Queue<DynamicMessage>>,
    paths: Vec<&'static str>,
    schemas: Vec<fn() -> Vec<Schema>>,
    unmatched: Vec<Unmatched>,
}

impl DynamicSubscription {
    /// Subscribes to those `topics` that are selected and whose payload is one of `payloads`. What matches none of them is
    /// logged as a warning, and kept in [`unmatched`](Self::unmatched).
    pub fn new<'a, 'b>(
        topics: impl IntoIterator<Item = &'a dyn AnyTopic>,
        select: Select<'_>,
        payloads: impl Into<Payloads<'b>>,
        overflow: Overflow,
    ) -> Self {
        let topics: Vec<_> = topics.into_iter().collect();
        let subscription = Self::among(&topics, &[], select, &payloads.into(), overflow);
        subscription.warn();
        subscription
    }

    /// The same without a warning, where the paths `declared` have a publisher while the robot runs.
    pub(super) fn among(
        topics: &[&dyn AnyTopic],
        declared: &[&'static str],
        select: Select<'_>,
        payloads: &Payloads<'_>,
        overflow: Overflow,
    ) -> Self {
        let queue = Arc::new(Queue::new(overflow));
        let mut paths = Vec::new();
        let mut schemas = Vec::new();
        for topic in topics {
            if select.includes(topic.path()) && payloads.includes(topic.payload_name()) {
                topic.tap(&Tap(Arc::clone(&queue)));
                paths.push(topic.path());
                schemas.push(topic.schemas());
            }
        }
        let unmatched = unmatched(topics, declared, select, payloads);
        Self { queue, paths, schemas, unmatched }
    }

    /// Logs what is unmatched. No lock may be held: it runs the user's `tracing` subscriber.
    pub(super) fn warn(&self) {
        for unmatched in &self.unmatched {
            tracing::warn!("{unmatched}");
        }
    }

    pub(super) fn tap(&self) -> Tap {
        Tap(Arc::clone(&self.queue))
    }

    /// The paths it listened to when it was made. Of those made later at run time, it also listens to the selected ones.
    pub fn paths(&self) -> &[&'static str] {
        &self.paths
    }

    /// The definitions of what it listened to when it was made, by path: what a recorder would write.
    pub fn schemas(&self) -> impl Iterator<Item = (&'static str, Vec<Schema>)> + '_ {
        self.paths.iter().zip(&self.schemas).map(|(path, schemas)| (*path, schemas()))
    }

    /// What it asked for and matched nothing when it was made, with the nearest name for each.
    pub fn unmatched(&self) -> &[Unmatched] {
        &self.unmatched
    }

    /// The oldest message that waits, if any.
    pub fn try_recv(&self) -> Option<DynamicMessage> {
        self.queue.pop()
    }

    /// Waits for the next message, `timeout` at most; none after that. (It does not end by itself when the robot stops,
    /// since its publishers do so one by one.)
    pub fn recv_timeout(&self, timeout: Duration) -> Option<DynamicMessage> {
        self.queue.wait(Some(timeout))
    }

    /// The messages that wait now; those that arrive meanwhile are left.
    pub fn drain(&self) -> impl Iterator<Item = DynamicMessage> + '_ {
        (0..self.queue.len()).map_while(|_| self.try_recv())
    }

    /// How many messages wait now.
    pub fn waiting(&self) -> usize {
        self.queue.len()
    }

    /// How many messages were lost because this subscriber was slow.
    pub fn lagged(&self) -> u64 {
        self.queue.lagged()
    }
}

impl Drop for DynamicSubscription {
    fn drop(&mut self) {
        // Its topics let go of it at their next message.
        self.queue.abandon();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_silent_topic_forgets_those_who_have_left() {
        let topic = super::super::Topic::<crate::payload::JointState>::new("sensor/arm/encoder");
        let listen =
            || DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, Overflow::KeepLatest);
        let left: Vec<_> = (0..100).map(|_| Arc::downgrade(&listen().queue)).collect();
        let _last = listen();
        assert_eq!(left.iter().filter(|queue| queue.strong_count() > 0).count(), 0);
    }
}
