//! Writes bags of payloads, for measurements from other programs.

use crate::error::{RecordingError, create_error, write_error};
use crate::recorder::{FileWriter, channel_of, nanos};
use crate::{RecorderOptions, RecordingErrorKind};
use bb_core::message::Schema;
use bb_core::message::codec::{Field, Shape, encode, encode_as_ros};
use bb_core::{Payload, Stamped, WallTime};
use mcap::records::MessageHeader;
use std::collections::HashMap;
use std::fmt;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes payloads as their ROS messages to a new bag, which ROS 2 and this crate read. The messages of a robot are
/// written by a [`Recorder`](crate::Recorder).
///
/// A bag dropped without [`finish`](Self::finish) is complete, but an error at its end is not reported.
pub struct BagWriter {
    path: PathBuf,
    writer: Box<FileWriter>,
    channels: HashMap<String, Channel>,
    messages: u64,
    bytes: Vec<u8>,
}

struct Channel {
    id: u16,
    schema: Schema,
    /// The shape of the message written last, unless that was encoded already.
    shape: Option<Shape>,
    sequence: u32,
}

/// The type of a message.
enum Type<'a> {
    Shape { name: &'static str, shape: Shape },
    Schema(&'a Schema),
}

impl Type<'_> {
    fn schema(&self) -> Schema {
        match *self {
            Self::Shape { name, shape } => Schema::new(name, shape),
            Self::Schema(schema) => schema.clone(),
        }
    }

    fn shape(&self) -> Option<Shape> {
        match *self {
            Self::Shape { shape, .. } => Some(shape),
            Self::Schema(_) => None,
        }
    }

    /// Returns whether it is the type of the channel, by its definition.
    fn is_of(&self, channel: &Channel) -> bool {
        match self {
            Self::Shape { shape, .. } => channel.shape == Some(*shape) || self.schema() == channel.schema,
            Self::Schema(schema) => **schema == channel.schema,
        }
    }
}

impl BagWriter {
    /// Creates the file, with the chunks described by the options.
    ///
    /// # Errors
    /// The file exists already, or cannot be created.
    pub fn create(path: impl AsRef<Path>, options: &RecorderOptions) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let file = File::create_new(path).map_err(|cause| RecordingError::new(path, create_error(cause)))?;
        let writer = options.mcap().create(BufWriter::new(Box::new(file) as _));
        let writer = writer.map_err(|error| RecordingError::new(path, write_error(0, error)))?;
        let (channels, bytes) = (HashMap::new(), Vec::new());
        Ok(Self { path: path.to_owned(), writer: Box::new(writer), channels, messages: 0, bytes })
    }

    /// Writes a payload as ROS's message, logged at its wall time.
    ///
    /// # Errors
    /// ROS has no message for it, the topic has another type, or the file can no longer be written.
    pub fn payload<T: Payload>(&mut self, topic: &str, message: &Stamped<T>) -> Result<(), RecordingError> {
        self.bytes.clear();
        let shape = T::ROS.map_or(T::SHAPE, |layout| layout.shape());
        if !encode_as_ros(message, &mut self.bytes) {
            return Err(self.other_type(topic, T::NAME, "a payload that ROS has a message for"));
        }
        self.write_shape(topic, shape, message.wall_time)
    }

    /// Writes a type with ROS's fields and, by `#[payload(name = "package/Name")]`, ROS's name.
    ///
    /// # Errors
    /// The topic has another type, or the file can no longer be written.
    pub fn message<M: Field>(
        &mut self,
        topic: &str,
        log_time: WallTime,
        message: &M,
    ) -> Result<(), RecordingError> {
        self.bytes.clear();
        encode(message, &mut self.bytes);
        self.write_shape(topic, M::SHAPE, log_time)
    }

    /// Writes a message that is encoded already, in CDR. Types are compared by name and definition.
    ///
    /// # Errors
    /// The topic has another type, or the file can no longer be written.
    pub fn encoded(
        &mut self,
        topic: &str,
        schema: &Schema,
        log_time: WallTime,
        message: &[u8],
    ) -> Result<(), RecordingError> {
        self.bytes.clear();
        self.bytes.extend(message);
        self.write(topic, &Type::Schema(schema), log_time)
    }

    /// Writes the end of the file. Returns the number of messages.
    ///
    /// # Errors
    /// Writing failed.
    pub fn finish(mut self) -> Result<u64, RecordingError> {
        let (path, messages) = (self.path, self.messages);
        // The number of messages in it is unknown: it was never flushed.
        let fail = |error| RecordingError::new(&path, write_error(0, error));
        self.writer.finish().map_err(fail)?;
        self.writer.into_inner().flush().map_err(|cause| fail(cause.into()))?;
        Ok(messages)
    }

    fn write_shape(&mut self, topic: &str, shape: Shape, time: WallTime) -> Result<(), RecordingError> {
        let name = match shape {
            Shape::Struct(shape) => shape.name,
            _ => "",
        };
        self.write(topic, &Type::Shape { name, shape }, time)
    }

    /// Writes the bytes, which are of that type.
    fn write(&mut self, topic: &str, of: &Type<'_>, time: WallTime) -> Result<(), RecordingError> {
        if !self.channels.contains_key(topic) {
            let schema = of.schema();
            let id = channel_of(&mut self.writer, topic, &schema, "").map_err(|error| self.fail(error))?;
            self.channels.insert(topic.to_owned(), Channel { id, schema, shape: of.shape(), sequence: 0 });
        }
        let Some(channel) = self.channels.get_mut(topic) else { return Ok(()) };
        if !of.is_of(channel) {
            let (known, name) = (channel.schema.name.clone(), of.schema().name);
            let wanted = if known == name { format!("{known} as it was defined before") } else { known };
            return Err(self.other_type(topic, &name, &wanted));
        }
        channel.shape = of.shape();
        let (log_time, sequence) = (nanos(time), channel.sequence);
        channel.sequence = channel.sequence.wrapping_add(1);
        let header = MessageHeader { channel_id: channel.id, sequence, log_time, publish_time: log_time };
        let written = self.writer.write_to_known_channel(&header, &self.bytes);
        written.map_err(|error| self.fail(error))?;
        self.messages += 1;
        Ok(())
    }

    fn fail(&self, error: mcap::McapError) -> RecordingError {
        RecordingError::new(&self.path, write_error(0, error))
    }

    fn other_type(&self, topic: &str, schema: &str, wanted: &str) -> RecordingError {
        let (topic, schema, wanted) = (topic.to_owned(), schema.to_owned(), wanted.to_owned());
        RecordingError::new(&self.path, RecordingErrorKind::OtherType { topic, schema, wanted })
    }
}

impl fmt::Debug for BagWriter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BagWriter")
            .field("path", &self.path)
            .field("messages", &self.messages)
            .finish_non_exhaustive()
    }
}
