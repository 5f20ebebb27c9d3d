//! Data for viewers in a recording: the identity of the robot, and topics that no component published.

use super::{FileWriter, ROBOT, RecorderOptions, URDF};
use bb_core::WallTime;
use bb_core::message::Schema;
use bb_core::message::codec::{Field, Shape, encode};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapResult};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Identifies the robot, at the beginning.
pub(super) fn describe(writer: &mut FileWriter, options: &RecorderOptions) -> McapResult<()> {
    let Some(robot) = &options.robot else { return Ok(()) };
    let metadata = BTreeMap::from([("name".to_owned(), robot.name.to_owned())]);
    writer.write_metadata(&Metadata { name: ROBOT.to_owned(), metadata })?;
    writer.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: URDF.to_owned(),
        media_type: "application/xml".to_owned(),
        data: Cow::Borrowed(robot.urdf.as_bytes()),
    })
}

/// A channel for viewers.
pub(super) fn view<T: Field>(writer: &mut FileWriter, topic: &str, qos: &str) -> McapResult<u16> {
    let name = match T::SHAPE {
        Shape::Struct(shape) => shape.name,
        _ => "",
    };
    channel_of(writer, topic, &Schema::new(name, T::SHAPE), qos)
}

/// A channel of messages in CDR.
pub(crate) fn channel_of(writer: &mut FileWriter, topic: &str, schema: &Schema, qos: &str) -> McapResult<u16> {
    // ROS's player requires it.
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
    let schema = writer.add_schema(&schema.name, Schema::ENCODING, schema.text.as_bytes())?;
    writer.add_channel(schema, topic, Schema::MESSAGE_ENCODING, &metadata)
}

/// A message that late subscribers get as well.
pub(super) fn latched<T: Field>(
    writer: &mut FileWriter,
    topic: &str,
    time: WallTime,
    message: &T,
) -> McapResult<()> {
    let id = view::<T>(writer, topic, LATCHED)?;
    let mut bytes = Vec::new();
    encode(message, &mut bytes);
    let log_time = nanos(time);
    let header = MessageHeader { channel_id: id, sequence: 0, log_time, publish_time: log_time };
    writer.write_to_known_channel(&header, &bytes)
}

/// Keep the last, reliable, transient local: as written by ROS's recorder.
const LATCHED: &str = "- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
";

/// MCAP has no times before 1970.
pub(crate) fn nanos(time: WallTime) -> u64 {
    u64::try_from(time.as_unix_nanos()).unwrap_or(0)
}
