//! Types of options that name a declaration of the robot: `sensor::battery.voltage`, `command::land`.

use crate::message::Payload;
use crate::pubsub::DynamicMessage;
use std::fmt;
use std::sync::Arc;

/// A number in the messages of a topic: the type of an option that `robot!` fills from `sensor::battery.voltage`.
///
/// The path, the field, and that the field is a [`Number`] are checked when the robot is compiled. Another option of the component
/// that is marked `#[option(compared_with = "when")]`, where `when` is the name of this one, must have the unit of the field.
#[derive(Clone, Default)]
pub struct TopicField {
    path: &'static str,
    field: &'static str,
    read: Option<Arc<Read>>,
}

/// Reads the number in a message.
type Read = dyn Fn(&DynamicMessage) -> Option<f64> + Send + Sync;

impl TopicField {
    /// The field `field` of the messages at `path`, which `number` reads.
    #[doc(hidden)]
    pub fn of<P: Payload>(path: &'static str, field: &'static str, number: fn(&P) -> Option<f64>) -> Self {
        let read = move |message: &DynamicMessage| number(message.downcast::<P>()?);
        Self { path, field, read: Some(Arc::new(read)) }
    }

    /// The path of the topic: `sensor/battery`.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// The names of the field after the path: `voltage`.
    pub fn field(&self) -> &'static str {
        self.field
    }

    /// The number in a message of the topic; `None` if the field is `None`, or the message is of another topic.
    pub fn number_in(&self, message: &DynamicMessage) -> Option<f64> {
        self.read.as_ref()?(message)
    }
}

impl PartialEq for TopicField {
    fn eq(&self, other: &Self) -> bool {
        (self.path, self.field) == (other.path, other.field)
    }
}

impl fmt::Display for TopicField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.path, self.field)
    }
}

impl fmt::Debug for TopicField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TopicField({self})")
    }
}

/// The path of a command: the type of an option that `robot!` fills from `command::land`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CommandPath(&'static str);

impl CommandPath {
    #[doc(hidden)]
    pub const fn new(path: &'static str) -> Self {
        Self(path)
    }

    /// The path: `command/land`.
    pub fn path(self) -> &'static str {
        self.0
    }
}

/// The type of a field that can be compared with a number.
#[diagnostic::on_unimplemented(
    message = "this field is of type `{Self}`, which is not a number",
    label = "not a number",
    note = "name a number within it, as in `sensor::base::imu.angular_velocity.x`; a number may be optional"
)]
pub trait Number {
    /// Returns its value; `None` if the field has no value.
    fn number(&self) -> Option<f64>;
}

macro_rules! numbers {
    ($($kind:ty),*) => { $(impl Number for $kind {
        fn number(&self) -> Option<f64> {
            Some(*self as f64)
        }
    })* };
}

numbers!(f64, f32, i8, i16, i32, i64, u8, u16, u32, u64, usize);

impl<T: Number> Number for Option<T> {
    fn number(&self) -> Option<f64> {
        self.as_ref()?.number()
    }
}

/// Returns the number of a field, see [`Number::number`].
pub fn number_of<T: Number>(field: &T) -> Option<f64> {
    field.number()
}
