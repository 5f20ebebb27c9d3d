//! Data for viewers in a recording: the identity of the robot, and topics that no component published.

use super::{FileWriter, ROBOT, RecorderOptions, URDF};
use bb_core::WallTime;
use bb_core::joints::{ViewerChannel, ViewerMessages};
use bb_core::message::Schema;
use mcap::records::Metadata;
use mcap::{Attachment, McapResult};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Identifies the robot, at the beginning.
pub(super) fn describe(
    writer: &mut FileWriter,
    options: &RecorderOptions,
    viewers: Option<&ViewerMessages>,
) -> McapResult<()> {
    let (Some(robot), Some(viewers)) = (&options.robot, viewers) else { return Ok(()) };
    let metadata = BTreeMap::from([("name".to_owned(), robot.name.to_owned())]);
    writer.write_metadata(&Metadata { name: ROBOT.to_owned(), metadata })?;
    writer.attach(&Attachment {
        log_time: 0,
        create_time: 0,
        name: URDF.to_owned(),
        media_type: "application/xml".to_owned(),
        data: Cow::Borrowed(viewers.urdf().as_bytes()),
    })
}

/// A channel for viewers.
pub(super) fn view(writer: &mut FileWriter, channel: ViewerChannel) -> McapResult<u16> {
    channel_of(writer, channel.topic(), &channel.schema(), if channel.is_latched() { LATCHED } else { "" })
}

/// A channel of messages in CDR.
pub(crate) fn channel_of(writer: &mut FileWriter, topic: &str, schema: &Schema, qos: &str) -> McapResult<u16> {
    // ROS's player requires it.
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_owned())]);
    let schema = writer.add_schema(&schema.name, Schema::ENCODING, schema.text.as_bytes())?;
    writer.add_channel(schema, topic, Schema::MESSAGE_ENCODING, &metadata)
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
