//! One message of a bag.

use crate::definition::{MessageDefinition, Value};
use crate::error::{RecordingError, RecordingErrorKind};
use crate::file::full_name;
use bb_core::message::codec::ros::Header;
use bb_core::message::codec::{Reader, Shape, decode, decode_as_ros};
use bb_core::message::{DecodeError, Field};
use bb_core::{Payload, Stamped, WallTime};
use std::path::Path;
use std::sync::Arc;

/// One message of a bag.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct BagMessage {
    /// The topic it was published on; the same allocation for every message of the topic.
    pub topic: Arc<str>,
    /// Type in the full spelling, as `sensor_msgs/msg/Imu`.
    pub schema: Arc<str>,
    /// Time at which the recorder received it, in nanoseconds of the recorder's clock, usually since 1970. The
    /// measurement time is in the header.
    pub log_time_ns: u64,
    /// The encoded message; decompressed, if the message was compressed individually.
    pub data: Vec<u8>,
    /// The encoding of `data`; only `cdr` can be decoded here.
    pub encoding: Arc<str>,
    path: Arc<Path>,
    /// Number of the message on its topic, from 1.
    number: u64,
    /// Byte at which its record starts, or the chunk that holds it.
    byte: u64,
}

impl BagMessage {
    pub(super) fn new(
        topic: &Arc<str>,
        kind: &MessageKind,
        log_time_ns: u64,
        data: Vec<u8>,
        path: &Arc<Path>,
        number: u64,
        byte: u64,
    ) -> Self {
        let MessageKind { schema, encoding } = kind.clone();
        Self { topic: Arc::clone(topic), schema, log_time_ns, data, encoding, path: Arc::clone(path), number, byte }
    }

    /// The payload of the ROS message that corresponds to `T`, and the time in its header; see the table in
    /// [`bb_core::message::codec::ros`].
    ///
    /// # Errors
    /// The message is of another type, or its bytes are damaged.
    pub fn payload<T: Payload>(&self) -> Result<(T, WallTime), RecordingError> {
        let wanted = Stamped::<T>::ros_name().unwrap_or(T::NAME);
        self.read(wanted, decode_as_ros)
    }

    /// The message as a type with ROS's fields and, by `#[payload(name = "package/Name")]`, ROS's name.
    ///
    /// # Errors
    /// The message is of another type, or its bytes are damaged.
    pub fn decode<M: Field>(&self) -> Result<M, RecordingError> {
        let wanted = match M::SHAPE {
            Shape::Struct(shape) => shape.name,
            _ => "",
        };
        self.read(wanted, decode)
    }

    /// The header at the beginning of the message, which most messages have: the time and the frame of its values.
    ///
    /// # Errors
    /// Its bytes are not a header.
    pub fn header(&self) -> Result<Header, RecordingError> {
        self.check_encoding()?;
        Reader::of_message(&self.data)
            .and_then(|mut reader| Header::read(&mut reader))
            .map_err(|error| self.fault(error))
    }

    /// The fields of a message of any type.
    ///
    /// # Errors
    /// Its bytes are damaged, or the definition is of another type.
    pub fn value(&self, definition: &MessageDefinition) -> Result<Value, RecordingError> {
        self.check_encoding()?;
        definition.read(&self.data).map_err(|error| self.fault(error))
    }

    fn check_encoding(&self) -> Result<(), RecordingError> {
        check(&self.topic, &self.encoding).map_err(|kind| RecordingError::new(&self.path, kind))
    }

    fn read<T>(
        &self,
        wanted: &str,
        read: impl FnOnce(&[u8]) -> Result<T, DecodeError>,
    ) -> Result<T, RecordingError> {
        if !is_named(&self.schema, wanted) {
            let topic = self.topic.to_string();
            let kind =
                RecordingErrorKind::OtherType { topic, schema: self.schema.to_string(), wanted: full_name(wanted) };
            return Err(RecordingError::new(&self.path, kind));
        }
        self.check_encoding()?;
        read(&self.data).map_err(|error| self.fault(error))
    }

    fn fault(&self, fault: impl ToString) -> RecordingError {
        let kind = RecordingErrorKind::Payload {
            topic: self.topic.to_string(),
            schema: self.schema.to_string(),
            message: self.number,
            log_time_ns: self.log_time_ns,
            byte: self.byte,
            fault: fault.to_string(),
        };
        RecordingError::new(&self.path, kind)
    }
}

/// Returns whether `schema`, in the full spelling, is the type `name`: `sensor_msgs/msg/Imu` is `sensor_msgs/Imu`.
fn is_named(schema: &str, name: &str) -> bool {
    schema == name
        || name.split_once('/').is_some_and(|(package, name)| {
            let rest = schema.strip_prefix(package).and_then(|rest| rest.strip_prefix("/msg/"));
            rest == Some(name)
        })
}

/// A chosen topic.
#[derive(Debug)]
pub(crate) struct Wanted {
    pub(crate) topic: Arc<str>,
    /// The minimum number of messages, from the summary.
    pub(crate) expected: u64,
    /// The number of messages so far.
    pub(crate) count: u64,
}

/// Properties common to the messages of a channel.
#[derive(Clone, Debug)]
pub(super) struct MessageKind {
    pub(super) schema: Arc<str>,
    pub(super) encoding: Arc<str>,
}

/// Checks that messages of this topic can be read.
pub(crate) fn check(topic: &str, encoding: &str) -> Result<(), RecordingErrorKind> {
    match encoding {
        "cdr" => Ok(()),
        _ => Err(RecordingErrorKind::Encoding { topic: topic.into(), encoding: encoding.into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_compared_in_both_spellings() {
        assert!(is_named("sensor_msgs/msg/Imu", "sensor_msgs/Imu"));
        assert!(is_named("sensor_msgs/msg/Imu", "sensor_msgs/msg/Imu"));
        assert!(!is_named("sensor_msgs/msg/Imu", "sensor_msgs/Im"));
        assert!(!is_named("sensor_msgs/msg/Imu", "geometry_msgs/Imu"));
    }

    #[test]
    fn only_cdr_is_read() {
        assert!(check("/imu", "cdr").is_ok());
        let said = check("/imu", "ros1").expect_err("it is not CDR").to_string();
        assert!(said.starts_with("the messages of /imu are encoded as `ros1`"), "{said}");
    }
}
