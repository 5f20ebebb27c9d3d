//! Implements the type-erased interfaces for messages and topics of a known payload.

use super::any::{AnyMessage, AnyTopic, DynamicMessage, Encoded, Tap};
use super::statistics::{SubscriberStatistics, TopicStatistics};
use super::topic::Topic;
use crate::message::codec::{
    Layouts, decode, decode_as_ros, encode, encode_as_ros, encode_companion, is_exact_as_ros, to_json,
};
use crate::message::{DecodeError, JointReading, Payload, Stamp, Stamped};
use std::any::Any;
use std::fmt;
use std::sync::Arc;
use std::task::Waker;

impl<T: Payload> AnyMessage for Stamped<T> {
    fn payload_name(&self) -> &'static str {
        T::NAME
    }
    fn type_name(&self) -> &'static str {
        std::any::type_name::<T>()
    }
    fn stamp(&self) -> Stamp {
        Stamped::stamp(self)
    }
    fn as_any(&self) -> &dyn Any {
        self
    }

    fn tell_joints(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        self.payload.tell_joints(listener);
    }
    fn fmt_payload(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.payload, f)
    }
    fn encode(&self, bytes: &mut Vec<u8>) {
        encode(self, bytes);
    }
    fn layouts(&self) -> Layouts {
        Self::LAYOUTS
    }
    fn encode_as_ros(&self, bytes: &mut Vec<u8>) -> bool {
        encode_as_ros(self, bytes)
    }
    fn encode_companion(&self, bytes: &mut Vec<u8>) -> bool {
        encode_companion(self, bytes)
    }
    fn is_exact_as_ros(&self) -> bool {
        is_exact_as_ros(self)
    }
    fn to_json(&self) -> String {
        to_json(self)
    }
    fn new_topic(&self, path: &'static str) -> Arc<dyn AnyTopic> {
        Arc::new(Topic::<T>::new(path))
    }
    fn fits(&self, topic: &dyn AnyTopic) -> bool {
        topic.as_any().is::<Topic<T>>()
    }
}

impl<T: Payload> AnyTopic for Topic<T> {
    fn path(&self) -> &'static str {
        self.hub.path
    }

    fn payload_name(&self) -> &'static str {
        T::NAME
    }

    fn layouts(&self) -> Layouts {
        Stamped::<T>::LAYOUTS
    }

    fn subscribers(&self) -> Vec<SubscriberStatistics> {
        self.hub.subscribers()
    }

    fn tap(&self, tap: &Tap) {
        self.hub.tap(tap);
    }

    fn decode(&self, message: Encoded<'_>, stamp: &dyn Fn(Stamp) -> Stamp) -> Result<DynamicMessage, DecodeError> {
        let message: Stamped<T> = match message {
            Encoded::Exact(bytes) => decode(bytes)?,
            Encoded::Payload(bytes) => Stamp::default().message(decode(bytes)?),
            Encoded::Ros(bytes) => {
                let (payload, wall_time) = decode_as_ros(bytes)?;
                Stamp { wall_time, ..Stamp::default() }.message(payload)
            }
        };
        let stamp = stamp(message.stamp());
        Ok(DynamicMessage::of(self.hub.path, stamp.message(message.payload)))
    }

    fn publish_dynamic(&self, message: &DynamicMessage) -> bool {
        let message = message.downcast();
        message.inspect(|message| self.publish(message)).is_some()
    }

    fn publish_dynamic_as_written(&self, message: &DynamicMessage, write: &mut dyn FnMut()) -> bool {
        let message = message.downcast();
        message.inspect(|message| self.publish_as_written(message, write)).is_some()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }

    fn depends_on_frame(&self) -> bool {
        T::DEPENDS_ON_FRAME
    }

    fn statistics(&self) -> TopicStatistics {
        self.hub.statistics(T::NAME)
    }

    fn close(&self) -> Vec<Waker> {
        self.hub.close()
    }
}
