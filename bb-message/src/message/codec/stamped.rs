//! Whole messages: the exact layout, and that of ROS.

use super::ros::Header;
use super::{
    DecodeError, Field, FieldShape, Reader, RosCompanion, RosLayout, Schema, Shape, StructShape, Writer,
    json_schema, type_hash,
};
use crate::message::{Finite, Frame, Origin, Payload, Stamp, Stamped};
use crate::time::WallTime;

/// The layouts in which messages of one payload are written, for programs that do not know its type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layouts {
    name: &'static str,
    payload: Shape,
    exact: Shape,
    ros: Option<&'static StructShape>,
    companion: Option<(&'static str, &'static StructShape)>,
}

impl Layouts {
    /// Returns the layouts of a payload.
    pub const fn of<T: Payload>() -> Self {
        let (name, payload, exact) = (T::NAME, T::SHAPE, <Stamped<T> as Field>::SHAPE);
        let ros = match &T::ROS {
            Some(RosLayout { shape: Shape::Struct(shape), .. }) => Some(*shape),
            _ => None,
        };
        let companion = match &T::ROS {
            Some(RosLayout {
                companion: Some(RosCompanion { topic, shape: Shape::Struct(shape), .. }), ..
            }) => Some((*topic, *shape)),
            _ => None,
        };
        Self { name, payload, exact, ros, companion }
    }

    /// The shape of the payload.
    pub const fn payload(&self) -> Shape {
        self.payload
    }

    /// The JSON Schema of the payload.
    pub fn json_schema(&self) -> String {
        json_schema(self.payload)
    }

    /// The definition of a message in the exact layout.
    pub fn schema(&self) -> Schema {
        Schema::new(&self.exact_name(), self.exact)
    }

    fn exact_name(&self) -> String {
        // The name of the definition is that given to the derive, if any: two types with the same name need two.
        let name = match self.payload {
            Shape::Struct(shape) => shape.name,
            Shape::Enum(shape) => shape.name,
            _ => self.name,
        };
        format!("{name}Stamped")
    }

    /// The name of ROS's message, `sensor_msgs/Imu`, if ROS has one for the payload.
    pub fn ros_name(&self) -> Option<&'static str> {
        self.ros.map(|shape| shape.name)
    }

    /// The [`type_hash`] of a message in the exact layout.
    pub fn type_hash(&self) -> String {
        type_hash(&self.exact_name(), self.exact)
    }

    /// ROS's definition of a message, if ROS has one for the payload.
    pub fn ros_schema(&self) -> Option<Schema> {
        self.ros.map(Schema::of)
    }

    /// The [`type_hash`] of ROS's message, if ROS has one for the payload.
    pub fn ros_type_hash(&self) -> Option<String> {
        self.ros.map(|shape| type_hash(shape.name, Shape::Struct(shape)))
    }

    /// The last part of the topic and the definition of a second message, if ROS has two for the payload.
    pub fn ros_companion(&self) -> Option<(&'static str, Schema)> {
        self.companion.map(|(topic, shape)| (topic, Schema::of(shape)))
    }

    /// The [`type_hash`] of the second message, if ROS has two for the payload.
    pub fn ros_companion_type_hash(&self) -> Option<String> {
        self.companion.map(|(_, shape)| type_hash(shape.name, Shape::Struct(shape)))
    }

    /// The topic and the definition by which viewers know the messages at `path`: those of ROS if it has a message for the payload, else
    /// the exact ones.
    pub fn channel(&self, path: &str) -> (String, Schema) {
        (format!("/{path}"), self.ros_schema().unwrap_or_else(|| self.schema()))
    }

    /// The topic and the definition of the second message, if ROS has two for the payload.
    pub fn companion_channel(&self, path: &str) -> Option<(String, Schema)> {
        self.ros_companion().map(|(topic, schema)| (format!("/{path}/{topic}"), schema))
    }

    /// The exact definition, and those of ROS.
    #[doc(hidden)]
    pub fn schemas(&self) -> Vec<Schema> {
        let companion = self.ros_companion().map(|(_, schema)| schema);
        [Some(self.schema()), self.ros_schema(), companion].into_iter().flatten().collect()
    }
}

impl<T: Payload> Stamped<T> {
    /// The layouts in which messages of this payload are written.
    pub const LAYOUTS: Layouts = Layouts::of::<T>();

    /// The information a program needs to read a message in the exact layout without knowing the payload.
    pub fn schema() -> Schema {
        Self::LAYOUTS.schema()
    }

    /// ROS's definition of a message, if ROS has one for the payload.
    pub fn ros_schema() -> Option<Schema> {
        Self::LAYOUTS.ros_schema()
    }

    /// The name of ROS's message, `sensor_msgs/Imu`, if ROS has one for the payload.
    pub fn ros_name() -> Option<&'static str> {
        Self::LAYOUTS.ros_name()
    }

    /// The last part of the topic and the definition of a second message, if ROS has two for the payload.
    pub fn ros_companion() -> Option<(&'static str, Schema)> {
        Self::LAYOUTS.ros_companion()
    }

    /// The [`type_hash`] of ROS's message, if ROS has one for the payload.
    pub fn ros_type_hash() -> Option<String> {
        Self::LAYOUTS.ros_type_hash()
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
