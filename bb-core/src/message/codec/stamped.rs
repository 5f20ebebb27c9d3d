//! Whole messages: the exact layout, and that of ROS.

use super::ros::Header;
use super::{
    DecodeError, Field, FieldShape, Reader, RosCompanion, RosLayout, Schema, Shape, StructShape, Writer, type_hash,
};
use crate::message::{Finite, Frame, Origin, Payload, Stamp, Stamped};
use crate::time::WallTime;

impl<T: Payload> Stamped<T> {
    /// The information a program needs to read a message in the exact layout without knowing the payload.
    pub fn schema() -> Schema {
        exact_schema(T::NAME, T::SHAPE, Self::SHAPE)
    }

    /// ROS's definition of a message, if ROS has one for the payload.
    pub fn ros_schema() -> Option<Schema> {
        ros_shape::<T>().map(Schema::of)
    }

    /// The name of ROS's message, `sensor_msgs/Imu`, if ROS has one for the payload.
    pub fn ros_name() -> Option<&'static str> {
        ros_shape::<T>().map(|shape| shape.name)
    }

    /// The last part of the topic and the definition of a second message, if ROS has two for the payload.
    pub fn ros_companion() -> Option<(&'static str, Schema)> {
        const { ros_companion::<T>() }.map(|(topic, shape)| (topic, Schema::of(shape)))
    }

    /// The exact definition, and those of ROS.
    pub(crate) fn schemas() -> Vec<Schema> {
        let companion = const { ros_companion::<T>() }.map(|(_, shape)| shape);
        all_schemas(exact_schema(T::NAME, T::SHAPE, Self::SHAPE), ros_shape::<T>(), companion)
    }

    /// The [`type_hash`] of ROS's message, if ROS has one for the payload.
    pub fn ros_type_hash() -> Option<String> {
        ros_shape::<T>().map(|shape| type_hash(shape.name, Shape::Struct(shape)))
    }
}

/// The name of the definition is that given to the derive, if any: two types with the same name need two.
fn exact_schema(name: &str, payload: Shape, message: Shape) -> Schema {
    let name = match payload {
        Shape::Struct(shape) => shape.name,
        Shape::Enum(shape) => shape.name,
        _ => name,
    };
    Schema::new(&format!("{name}Stamped"), message)
}

fn all_schemas(
    exact: Schema,
    ros: Option<&'static StructShape>,
    companion: Option<&'static StructShape>,
) -> Vec<Schema> {
    let mut schemas = vec![exact];
    schemas.extend(ros.map(Schema::of));
    schemas.extend(companion.map(Schema::of));
    schemas
}

const fn ros_shape<T: Payload>() -> Option<&'static StructShape> {
    match &T::ROS {
        Some(RosLayout { shape: Shape::Struct(shape), .. }) => Some(shape),
        _ => None,
    }
}

const fn ros_companion<T: Payload>() -> Option<(&'static str, &'static StructShape)> {
    match &T::ROS {
        Some(RosLayout { companion: Some(RosCompanion { topic, shape: Shape::Struct(shape), .. }), .. }) => {
            Some((topic, shape))
        }
        _ => None,
    }
}

impl<T: Payload> Finite for Stamped<T> {
    fn is_finite(&self) -> bool {
        T::is_finite(&self.payload)
    }
}

/// The exact layout: a `std_msgs/Header` for viewers, the rest of the stamp, and the payload.
impl<T: Payload> Field for Stamped<T> {
    const SHAPE: Shape = Shape::Struct(&StructShape {
        name: "Stamped",
        fields: &[
            FieldShape::new("header", Header::SHAPE),
            FieldShape::new("monotonic_time", Shape::I64),
            FieldShape::new("wall_time", Shape::I64),
            FieldShape::new("robot", Shape::Text),
            FieldShape::new("node", Shape::Text),
            FieldShape::new("payload", T::SHAPE),
        ],
    });
    const IS_INLINE: bool = T::IS_INLINE;

    fn heap_bytes(&self) -> usize {
        self.payload.heap_bytes()
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.stamp().write(writer);
        self.payload.write(writer);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let stamp = Stamp::read(reader)?;
        Ok(stamp.message(reader.field("payload")?))
    }
}

impl Stamp {
    fn write(&self, writer: &mut Writer<'_>) {
        Header::write_parts(self.wall_time, self.frame.name(), writer);
        self.monotonic_time.write(writer);
        self.wall_time.write(writer);
        writer.text(self.origin.robot);
        writer.text(self.origin.node);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let frame = Header::read_frame(reader).map_err(|error| error.within("header"))?;
        Ok(Self {
            frame: Frame::new(frame),
            monotonic_time: reader.field("monotonic_time")?,
            wall_time: reader.field("wall_time")?,
            origin: Origin { robot: reader.field("robot")?, node: reader.field("node")? },
        })
    }
}

/// Appends a message in ROS's layout; returns false and appends nothing if ROS has none for its payload.
pub fn encode_as_ros<T: Payload>(message: &Stamped<T>, bytes: &mut Vec<u8>) -> bool {
    let Some(layout) = &T::ROS else { return false };
    (layout.write)(message, &mut Writer::of_message(bytes));
    true
}

/// Appends the second message of a payload for which ROS has two; returns `false` and appends nothing if there is none.
pub fn encode_companion<T: Payload>(message: &Stamped<T>, bytes: &mut Vec<u8>) -> bool {
    let Some(RosLayout { companion: Some(companion), .. }) = &T::ROS else { return false };
    let start = bytes.len();
    let is_there = (companion.write)(message, &mut Writer::of_message(bytes));
    if !is_there {
        bytes.truncate(start);
    }
    is_there
}

/// Adds the contents of a message written by [`encode_companion`] to the payload read by [`decode_as_ros`].
///
/// # Errors
/// ROS has no second message for the payload, or the bytes are wrong.
pub fn decode_companion<T: Payload>(payload: &mut T, bytes: &[u8]) -> Result<(), DecodeError> {
    match &T::ROS {
        Some(RosLayout { companion: Some(companion), .. }) => {
            (companion.read)(payload, &mut Reader::of_message(bytes)?)
        }
        _ => Err(DecodeError::new(0, "a payload that ROS has two messages for", T::NAME)),
    }
}

/// The payload and the wall time of a message in ROS's layout. It does not contain its frame, origin and monotonic
/// time.
///
/// # Errors
/// ROS has no layout for the payload, or the bytes are wrong.
pub fn decode_as_ros<T: Payload>(bytes: &[u8]) -> Result<(T, WallTime), DecodeError> {
    match &T::ROS {
        // Bytes after the message are ignored: ROS counts padding for empty lists that it does not write, so some of
        // its own messages end with meaningless bytes.
        Some(layout) => (layout.read)(&mut Reader::of_message(bytes)?),
        None => Err(DecodeError::new(0, "a payload that ROS has a message for", T::NAME)),
    }
}

/// Returns whether payload and wall time of a message read back from ROS's layout bit for bit, including the second message if
/// there is one.
pub fn is_exact_as_ros<T: Payload>(message: &Stamped<T>) -> bool {
    // Through a pointer in the constant, so that it is compiled only for payloads that ROS has a message for.
    match &T::ROS {
        Some(layout) => (layout.is_exact)(message),
        None => false,
    }
}
