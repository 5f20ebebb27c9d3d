//! Headers, times and transforms.

use crate::message::Payload;
use crate::message::codec::intern::intern;
use crate::message::codec::{DecodeError, Field, Reader, Shape, Writer};
use crate::message::{Finite, Stamped};
use crate::time::WallTime;
use nalgebra::Isometry3;
use std::time::Duration;

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// `builtin_interfaces/msg/Time`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
#[payload(name = "builtin_interfaces/Time")]
pub struct Time {
    /// Whole seconds since the Unix epoch.
    pub sec: i32,
    /// Nanoseconds on top of them.
    pub nanosec: u32,
}

impl Time {
    /// The time, or the nearest that 32 bits of seconds hold.
    pub fn of(time: WallTime) -> Self {
        let nanos = time.as_unix_nanos();
        match i32::try_from(nanos.div_euclid(NANOS_PER_SECOND)) {
            // The remainder is below 1e9.
            Ok(sec) => Self { sec, nanosec: nanos.rem_euclid(NANOS_PER_SECOND) as u32 },
            Err(_) if nanos < 0 => Self { sec: i32::MIN, nanosec: 0 },
            Err(_) => Self { sec: i32::MAX, nanosec: 999_999_999 },
        }
    }

    /// Returns the same time as nanoseconds.
    pub fn wall_time(self) -> WallTime {
        WallTime::from_unix_nanos(i64::from(self.sec) * NANOS_PER_SECOND + i64::from(self.nanosec))
    }
}

/// `builtin_interfaces/msg/Duration`
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
#[payload(name = "builtin_interfaces/Duration")]
pub(crate) struct DurationMessage {
    sec: i32,
    nanosec: u32,
}

impl DurationMessage {
    /// The duration, or the longest that 31 bits of seconds hold.
    pub(crate) fn of(duration: Duration) -> Self {
        match i32::try_from(duration.as_secs()) {
            Ok(sec) => Self { sec, nanosec: duration.subsec_nanos() },
            Err(_) => Self { sec: i32::MAX, nanosec: 999_999_999 },
        }
    }

    /// The duration.
    ///
    /// # Errors
    /// It is negative.
    pub(crate) fn duration(self) -> Result<Duration, DecodeError> {
        let seconds = u64::try_from(self.sec).map_err(|_| {
            DecodeError::new(0, "a duration that is not negative", self.sec.to_string()).within("sec")
        })?;
        Ok(Duration::from_secs(seconds) + Duration::from_nanos(self.nanosec.into()))
    }
}

/// `service_msgs/msg/ServiceEventInfo`, for the hashes of services.
#[derive(Clone, Debug, Payload)]
#[payload(name = "service_msgs/ServiceEventInfo")]
pub(in crate::message::codec) struct ServiceEventInfo {
    event_type: u8,
    stamp: Time,
    client_gid: [u8; 16],
    sequence_number: i64,
}

/// `byte`, for messages of ROS that have one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Byte(pub u8);

impl Finite for Byte {
    fn is_finite(&self) -> bool {
        true
    }
}

impl Field for Byte {
    const IS_INLINE: bool = true;
    const SHAPE: Shape = Shape::Byte;
    fn write(&self, writer: &mut Writer<'_>) {
        self.0.write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        u8::read(reader).map(Self)
    }
}

/// `std_msgs/msg/Header`
#[derive(Clone, Debug, Default, PartialEq, Eq, Payload)]
#[payload(name = "std_msgs/Header")]
pub struct Header {
    /// Time of the measurement.
    pub stamp: Time,
    /// The frame of the values.
    pub frame_id: String,
}

impl Header {
    /// The header of a message whose values are in its frame.
    pub fn of<T>(message: &Stamped<T>) -> Self {
        Self::in_frame(message, message.frame.name())
    }

    /// The header of a message whose values are in another frame.
    pub fn in_frame<T>(message: &Stamped<T>, frame: &str) -> Self {
        Self::at(message.wall_time, frame)
    }

    fn at(time: WallTime, frame: &str) -> Self {
        Self { stamp: Time::of(time), frame_id: frame.to_owned() }
    }

    /// Writes a header without creating it.
    pub(in crate::message::codec) fn write_parts(time: WallTime, frame: &str, writer: &mut Writer<'_>) {
        Time::of(time).write(writer);
        writer.text(frame);
    }

    /// Reads a header, keeping only the frame.
    pub(in crate::message::codec) fn read_frame(reader: &mut Reader<'_>) -> Result<&'static str, DecodeError> {
        Time::read(reader).map_err(|error| error.within("stamp"))?;
        let frame = reader.text().map_err(|error| error.within("frame_id"))?;
        intern(frame).ok_or_else(|| reader.error("a name", "one more than are kept").within("frame_id"))
    }
}

/// `std_msgs/msg/String`
#[derive(Clone, Debug, Default, PartialEq, Eq, Payload)]
#[payload(name = "std_msgs/String")]
pub struct Text {
    /// The text.
    pub data: String,
}

/// `geometry_msgs/msg/TransformStamped`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "geometry_msgs/TransformStamped")]
pub struct TransformStamped {
    /// The time, and the frame that the transform leads to.
    pub header: Header,
    /// The frame that it leads from.
    pub child_frame_id: String,
    /// Transforms points from the child frame to the frame of the header.
    pub transform: Isometry3<f64>,
}

/// `tf2_msgs/msg/TFMessage`
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(name = "tf2_msgs/TFMessage")]
pub struct TransformsMessage {
    /// One per frame.
    pub transforms: Vec<TransformStamped>,
}

const _: () = {
    const fn is_payload<T: Payload + Finite>() {}
    is_payload::<TransformsMessage>();
};
