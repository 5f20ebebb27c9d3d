//! Messages of types that are known only from the definition in the file.
//!
//! The crate `re_ros_msg` reads the same, but panics on some malformed definitions, trusts lengths in the file when it
//! allocates, sorts the fields by name, and does not say which field is wrong.

mod known;
mod parse;
mod read;
mod ros1;
mod value;

pub use ros1::Ros1Definition;
pub use value::Value;

use bb_core::message::{DecodeError, Schema};
use std::sync::Arc;

/// The fields of a message type, to read any message of it; see
/// [`Topic::message_definition`](crate::Topic::message_definition). They come from the definition in the file
/// (`ros2msg`); bags in SQLite have none, so otherwise from the types in [`bb_core::message::codec::ros`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MessageDefinition {
    /// The type itself, then its component types.
    messages: Vec<Message>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Message {
    /// `sensor_msgs/Imu`
    name: String,
    fields: Vec<Field>,
    /// The names of the numbers of `kind`, of a message that is an enum.
    variants: Vec<(u32, Arc<str>)>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Field {
    name: Arc<str>,
    kind: Kind,
    count: Count,
}

/// The type of a field, or of the elements of a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Bool,
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
    F32,
    F64,
    Text,
    /// The number of an enum's variant; the message of this index has the variants' names.
    Variant(usize),
    /// Message of this index.
    Message(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Count {
    One,
    Exactly(usize),
    /// Preceded by a length.
    Any,
}

/// The deepest nesting of messages that is accepted.
const DEEPEST: usize = 32;

impl MessageDefinition {
    /// Returns the definition of a type in the full spelling, from that in the file: a text, and its format. Both may be empty.
    ///
    /// # Errors
    /// The text cannot be read, and the type is not a known one; in words.
    pub(crate) fn of(name: &str, encoding: &str, text: &str) -> Result<Self, String> {
        if encoding == Schema::ENCODING && !text.trim().is_empty() {
            return Self::parse(name, text);
        }
        match known::definition(name) {
            Some(text) => Self::parse(name, &text),
            None if name.is_empty() => Err("the file does not name the type of its messages".into()),
            None if text.is_empty() => {
                Err(format!("the file has no definition of {name}, and it is not a known type"))
            }
            None => Err(format!("{name} is defined in `{encoding}`, and only `{}` is read", Schema::ENCODING)),
        }
    }

    /// Parses a definition, followed by those of all types that it refers to, as written to bags by ROS 2
    /// (`ros2msg`).
    ///
    /// # Errors
    /// The line that is wrong; or a type that is not defined, or contains itself.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        parse::definition(name, text).map_err(|fault| format!("the definition of {name} is malformed: {fault}"))
    }

    /// Returns whether a message begins with a `std_msgs/Header`, which contains the time of its values.
    pub fn has_header(&self) -> bool {
        let first = self.messages.first().and_then(|message| message.fields.first());
        first.is_some_and(|field| match (field.kind, field.count) {
            (Kind::Message(index), Count::One) => self.messages[index].name == "std_msgs/Header",
            _ => false,
        })
    }

    /// Reads a message in CDR.
    ///
    /// # Errors
    /// The field that is wrong, and what was expected there.
    pub fn read(&self, data: &[u8]) -> Result<Value, DecodeError> {
        read::message(self, data)
    }
}
