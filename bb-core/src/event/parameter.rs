//! Parameters and their changes.

use crate::message::Payload;
use std::fmt;

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq, Payload)]
pub enum ParameterValue {
    /// `bool`
    Bool(bool),
    /// `i64`
    Integer(i64),
    /// `f64`, in SI
    Float(f64),
    /// `String`
    Text(String),
}

impl ParameterValue {
    /// Returns the type as written in `parameters`.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Bool(_) => "bool",
            Self::Integer(_) => "i64",
            Self::Float(_) => "f64",
            Self::Text(_) => "String",
        }
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Integer(value) => value.fmt(f),
            Self::Float(value) => write!(f, "{value:?}"),
            Self::Text(value) => write!(f, "{value:?}"),
        }
    }
}

/// A parameter that has changed, published at its path: `param/imu/beta`.
#[derive(Clone, Debug, PartialEq, Payload)]
#[non_exhaustive]
pub struct ParameterChange {
    /// Path.
    pub path: &'static str,
    /// The previous value.
    pub from: ParameterValue,
    /// The new value.
    pub to: ParameterValue,
    /// Caller that has set it, named as in [`CommandEvent`](super::CommandEvent).
    pub caller: String,
}
