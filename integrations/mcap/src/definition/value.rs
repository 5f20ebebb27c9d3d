//! Values whose types are known only at run time.

use std::sync::Arc;

/// A field of a message, or a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `bool`
    Bool(bool),
    /// A signed integer.
    Signed(i64),
    /// An unsigned integer.
    Unsigned(u64),
    /// The variant of an enum, and its name in the definition.
    Variant {
        /// Counted from zero.
        number: u32,
        /// Name in the spelling of message constants: `OUT_OF_RANGE`.
        name: Arc<str>,
    },
    /// `float32`
    F32(f32),
    /// `float64`
    F64(f64),
    /// `string`
    Text(String),
    /// A list of `uint8`.
    Bytes(Vec<u8>),
    /// Any other list.
    List(Vec<Value>),
    /// Fields in order.
    Message(Vec<(Arc<str>, Value)>),
}

impl Value {
    /// A number, including that of a variant, or a `bool` as 0 or 1.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            Self::Bool(value) => Some(f64::from(u8::from(*value))),
            Self::Signed(value) => Some(*value as f64),
            Self::Unsigned(value) => Some(*value as f64),
            Self::Variant { number, .. } => Some(f64::from(*number)),
            Self::F32(value) => Some(f64::from(*value)),
            Self::F64(value) => Some(*value),
            Self::Text(_) | Self::Bytes(_) | Self::List(_) | Self::Message(_) => None,
        }
    }

    /// The field of a message.
    pub fn field(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Message(fields) => fields.iter().find(|(field, _)| **field == *name).map(|(_, value)| value),
            _ => None,
        }
    }
}
