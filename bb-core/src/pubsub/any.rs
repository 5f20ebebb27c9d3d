//! Messages and topics whose payload type is erased.

use super::queue::Queue;
use super::statistics::{SubscriberStatistics, TopicStatistics};
use crate::message::codec::Layouts;
use crate::message::{DecodeError, JointReading, Payload, Schema, Stamp, Stamped};
use std::any::Any;
use std::fmt;
use std::sync::Arc;
use std::task::Waker;

/// A message whose payload type is erased; [`downcast`](Self::downcast) gives it back. Clones share the message.
#[derive(Clone)]
pub struct DynamicMessage {
    path: &'static str,
    message: Arc<dyn AnyMessage>,
    /// The bytes it holds, on the heap and inline: asked of the payload once, while no lock is held.
    bytes: usize,
}

/// Operations on a message for code that does not know its payload.
pub(super) trait AnyMessage: Send + Sync {
    fn payload_name(&self) -> &'static str;
    fn type_name(&self) -> &'static str;
    fn stamp(&self) -> Stamp;
    fn as_any(&self) -> &dyn Any;
    fn tell_joints(&self, listener: &mut dyn FnMut(JointReading<'_>));
    fn fmt_payload(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
    fn encode(&self, bytes: &mut Vec<u8>);
    fn layouts(&self) -> Layouts;
    fn encode_as_ros(&self, bytes: &mut Vec<u8>) -> bool;
    fn encode_companion(&self, bytes: &mut Vec<u8>) -> bool;
    fn is_exact_as_ros(&self) -> bool;
    fn to_json(&self) -> String;
    /// A topic for its payload.
    fn new_topic(&self, path: &'static str) -> Arc<dyn AnyTopic>;
    /// Returns whether the topic is one for the message's payload.
    fn fits(&self, topic: &dyn AnyTopic) -> bool;
}

impl DynamicMessage {
    pub(crate) fn new<T: Payload>(path: &'static str, message: &Stamped<T>) -> Self {
        Self::of(path, message.clone())
    }

    pub(crate) fn of<T: Payload>(path: &'static str, message: Stamped<T>) -> Self {
        let bytes = Self::bytes_of(&message);
        Self::sized(path, message, bytes)
    }

    /// A message of which [`bytes_of`](Self::bytes_of) is known: runs no code of the payload.
    pub(crate) fn sized<T: Payload>(path: &'static str, message: Stamped<T>, bytes: usize) -> Self {
        Self { path, message: Arc::new(message), bytes }
    }

    /// The bytes that a message holds, on the heap and inline.
    pub(crate) fn bytes_of<T: Payload>(message: &Stamped<T>) -> usize {
        let heap = if T::IS_INLINE { 0 } else { message.payload.heap_bytes() };
        size_of::<Stamped<T>>().saturating_add(heap)
    }

    pub(crate) fn bytes(&self) -> usize {
        self.bytes
    }

    pub(super) fn message(&self) -> &dyn AnyMessage {
        &*self.message
    }

    /// The layouts in which it is written.
    pub fn layouts(&self) -> Layouts {
        self.message.layouts()
    }

    /// The path it was published at.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// The name of its payload's type.
    pub fn payload_name(&self) -> &'static str {
        self.message.payload_name()
    }

    /// Returns the stamp: time of the measurement, frame and place.
    pub fn stamp(&self) -> Stamp {
        self.message.stamp()
    }

    /// The message, if its payload is a `T`.
    pub fn downcast<T: Payload>(&self) -> Option<&Stamped<T>> {
        self.message.as_any().downcast_ref()
    }

    /// Calls `listener` with the positions of joints it reports, if any; see
    /// [`JointPositions`](crate::JointPositions).
    pub fn tell_joints(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        self.message.tell_joints(listener);
    }

    /// Appends the message with its stamp, bit for bit, as CDR. The layout is [`schema`](Self::schema), and
    /// [`codec::decode`](crate::message::codec::decode) reads it as a `Stamped<T>`.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        self.message.encode(bytes);
    }

    /// The information a program needs to read it without knowing the payload.
    pub fn schema(&self) -> Schema {
        self.layouts().schema()
    }

    /// Appends the message in ROS's layout; returns `false` and appends nothing if ROS has no message for its
    /// payload. The monotonic time and the origin are not included.
    pub fn encode_as_ros(&self, bytes: &mut Vec<u8>) -> bool {
        self.message.encode_as_ros(bytes)
    }

    /// ROS's definition, if ROS has a message for its payload.
    pub fn ros_schema(&self) -> Option<Schema> {
        self.layouts().ros_schema()
    }

    /// Appends the second ROS message; returns `false` and appends nothing if there is none.
    pub fn encode_companion(&self, bytes: &mut Vec<u8>) -> bool {
        self.message.encode_companion(bytes)
    }

    /// The last part of the topic and the definition of a second message, if ROS has two for its payload.
    pub fn ros_companion(&self) -> Option<(&'static str, Schema)> {
        self.layouts().ros_companion()
    }

    /// Returns whether payload and wall time can be read back from ROS's layout bit for bit.
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

/// The bytes of a message.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub enum Encoded<'a> {
    /// The message with its stamp, as [`DynamicMessage::encode`] writes it.
    Exact(&'a [u8]),
    /// The message in ROS's layout, which has only a wall time.
    Ros(&'a [u8]),
    /// The payload alone, as [`encode`](crate::message::codec::encode) writes it.
    Payload(&'a [u8]),
}

/// The common interface of all topics.
pub trait AnyTopic: Any + Send + Sync {
    /// Returns the path.
    fn path(&self) -> &'static str;
    /// The name of its payload's type.
    fn payload_name(&self) -> &'static str;
    /// Returns whether the values of the messages are relative to a frame.
    #[doc(hidden)]
    fn depends_on_frame(&self) -> bool;
    /// The layouts in which its messages are written.
    fn layouts(&self) -> Layouts;
    /// All subscribers.
    fn subscribers(&self) -> Vec<SubscriberStatistics>;
    /// Hands every message to `tap` as well.
    #[doc(hidden)]
    fn tap(&self, tap: &Tap);
    /// Decodes a message; `stamp` completes what its bytes say of its stamp.
    #[doc(hidden)]
    fn decode(&self, message: Encoded<'_>, stamp: &dyn Fn(Stamp) -> Stamp) -> Result<DynamicMessage, DecodeError>;
    /// Publishes a message if its payload is this topic's; otherwise does nothing and returns `false`.
    fn publish_dynamic(&self, message: &DynamicMessage) -> bool;
    /// Publishes a message that `write` writes into a journal, if its payload is this topic's.
    #[doc(hidden)]
    fn publish_dynamic_as_written(&self, message: &DynamicMessage, write: &mut dyn FnMut()) -> bool;
    /// Returns the topic itself, to downcast to its type.
    #[doc(hidden)]
    fn as_any(&self) -> &dyn Any;
    /// Returns the counts.
    fn statistics(&self) -> TopicStatistics;
    /// Tells all subscribers that no more will come. Returns the tasks to wake, which is the subscribers' code.
    #[must_use = "a task that waits for a message waits for ever unless it is woken"]
    fn close(&self) -> Vec<Waker>;
}

/// The queue of an untyped subscriber, to which a topic hands messages.
#[doc(hidden)]
#[derive(Clone, Debug)]
pub struct Tap(pub(super) Arc<Queue<DynamicMessage>>);
