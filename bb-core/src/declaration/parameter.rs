//! Parameters: values that may be changed while the robot runs.

use super::Range;
use crate::event::ParameterValue;
use crate::message::codec::{JsonError, from_json};
use std::fmt;
use std::sync::Arc;

/// A parameter as declared.
#[derive(Clone, Copy, Debug)]
pub struct ParameterDeclaration {
    /// Path: `param/imu/beta`.
    pub path: &'static str,
    /// Doc comment.
    pub doc: &'static str,
    /// Value at the start, in SI.
    pub default: ParameterDefault,
    /// The numbers accepted, in SI.
    pub range: Option<Range>,
    /// The unit it was declared with.
    pub unit: &'static str,
}

/// The declared value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterDefault {
    /// `bool`
    Bool(bool),
    /// `i64`
    Integer(i64),
    /// `f64`
    Float(f64),
    /// `String`
    Text(&'static str),
}

impl From<ParameterDefault> for ParameterValue {
    fn from(default: ParameterDefault) -> Self {
        match default {
            ParameterDefault::Bool(value) => Self::Bool(value),
            ParameterDefault::Integer(value) => Self::Integer(value),
            ParameterDefault::Float(value) => Self::Float(value),
            ParameterDefault::Text(value) => Self::Text(value.to_owned()),
        }
    }
}

/// A value of the same type as `like`, from JSON in SI.
pub(crate) fn parameter_from_json(like: &ParameterValue, json: &str) -> Result<ParameterValue, JsonError> {
    Ok(match like {
        ParameterValue::Bool(_) => ParameterValue::Bool(from_json(json)?),
        ParameterValue::Integer(_) => ParameterValue::Integer(from_json(json)?),
        ParameterValue::Float(_) => ParameterValue::Float(from_json(json)?),
        ParameterValue::Text(_) => ParameterValue::Text(from_json(json)?),
    })
}

/// The types of parameters.
pub trait ParameterType: Sized + Clone + Send + Sync + 'static {
    /// The value, if it is of this type.
    fn from_value(value: &ParameterValue) -> Option<Self>;
    /// Converts it to a value.
    fn into_value(self) -> ParameterValue;
    /// The value used for a parameter that does not exist.
    #[doc(hidden)]
    fn none() -> Self;
}

macro_rules! parameter_type {
    ($($kind:ty, $variant:ident, $none:expr;)*) => { $(
        impl ParameterType for $kind {
            fn from_value(value: &ParameterValue) -> Option<Self> {
                match value {
                    ParameterValue::$variant(value) => Some(value.clone()),
                    _ => None,
                }
            }
            fn into_value(self) -> ParameterValue {
                ParameterValue::$variant(self)
            }
            fn none() -> Self {
                $none
            }
        }

        impl From<$kind> for ParameterValue {
            fn from(value: $kind) -> Self {
                Self::$variant(value)
            }
        }
    )* };
}

parameter_type! {
    bool, Bool, false;
    i64, Integer, 0;
    f64, Float, 0.0;
    String, Text, String::new();
}

impl ParameterDeclaration {
    /// Checks a new value; the error says what was expected.
    pub(crate) fn check(&self, value: &ParameterValue) -> Result<(), ParameterError> {
        let refuse = |message: String| Err(ParameterError { path: self.path.to_owned(), message });
        let expected = ParameterValue::from(self.default).type_name();
        if expected != value.type_name() {
            return refuse(format!("expected a value of type `{expected}`, found `{value}`"));
        }
        if let ParameterValue::Float(value) = value
            && !value.is_finite()
        {
            return refuse(format!("expected a finite number, found `{value}`"));
        }
        let Some(range) = self.range else { return Ok(()) };
        let is_inside = match value {
            ParameterValue::Float(value) => (range.start..=range.end).contains(value),
            // Compared as integers: a large one would be rounded to a float within the range.
            ParameterValue::Integer(value) => {
                (range.start.ceil() as i128..=range.end.floor() as i128).contains(&i128::from(*value))
            }
            ParameterValue::Bool(_) | ParameterValue::Text(_) => true,
        };
        if is_inside { Ok(()) } else { refuse(format!("expected a number in {}, found `{value}`", range.text)) }
    }
}

/// The values of all parameters at one time.
#[derive(Clone, Debug)]
pub struct ParameterValues(Arc<[ParameterValue]>);

impl ParameterValues {
    pub(crate) fn new(values: Vec<ParameterValue>) -> Self {
        Self(values.into())
    }

    /// All of them, in the order of their declaration.
    pub(crate) fn all(&self) -> &[ParameterValue] {
        &self.0
    }

    /// A copy with other values for the parameters of these numbers.
    pub(crate) fn with<'a>(&self, changes: impl IntoIterator<Item = (usize, &'a ParameterValue)>) -> Self {
        let mut values = self.0.to_vec();
        for (number, value) in changes {
            if let Some(slot) = values.get_mut(number) {
                *slot = value.clone();
            }
        }
        Self(values.into())
    }

    /// The value of the parameter of that number.
    pub fn get<T: ParameterType>(&self, number: usize) -> T {
        self.0.get(number).and_then(T::from_value).unwrap_or_else(T::none)
    }
}

/// Reason for which a parameter was not set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterError {
    /// Path of the parameter.
    pub path: String,
    /// Fault, with what was expected.
    pub message: String,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} is not set: {}", self.path, self.message)
    }
}

impl std::error::Error for ParameterError {}

#[cfg(test)]
mod tests {
    use super::*;

    const BETA: ParameterDeclaration = ParameterDeclaration {
        path: "param/imu/beta",
        doc: "",
        default: ParameterDefault::Float(0.1),
        range: Some(Range { start: 0.0, end: 1.0, text: "0.0..=1.0" }),
        unit: "",
    };

    #[test]
    fn a_refused_value_says_what_was_expected() {
        let refused = |value: ParameterValue| BETA.check(&value).expect_err("it is refused").to_string();
        assert_eq!(refused(3.0.into()), "param/imu/beta is not set: expected a number in 0.0..=1.0, found `3.0`");
        assert_eq!(refused(f64::NAN.into()), "param/imu/beta is not set: expected a finite number, found `NaN`");
        assert_eq!(refused(true.into()), "param/imu/beta is not set: expected a value of type `f64`, found `true`");
        assert_eq!(BETA.check(&1.0.into()), Ok(()));
    }

    #[test]
    fn the_largest_integers_are_not_rounded_into_their_range() {
        let (start, end) = (-9_007_199_254_740_992.0, 9_007_199_254_740_992.0);
        let default = ParameterDefault::Integer(0);
        let count = ParameterDeclaration { default, range: Some(Range { start, end, text: "" }), ..BETA };
        let accepts = |value: i64| count.check(&value.into()).is_ok();
        assert!(accepts(1 << 53) && accepts(-(1 << 53)));
        assert!(!accepts((1 << 53) + 1) && !accepts(-(1 << 53) - 1));
        assert!(!accepts(i64::MAX) && !accepts(i64::MIN));
    }
}
