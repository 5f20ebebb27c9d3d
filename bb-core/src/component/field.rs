//! Descriptions of options, and conversions from their literals.

use crate::declaration::{Dimension, Range};
use std::time::Duration;

/// The description of one option.
#[derive(Clone, Copy, Debug)]
pub struct OptionField {
    /// Name.
    pub name: &'static str,
    /// Doc comment.
    pub doc: &'static str,
    /// `true` if the option must be given.
    pub required: bool,
    /// Dimension, where a unit is stated.
    pub dimension: Option<Dimension>,
    /// The unit it was stated in.
    pub unit: &'static str,
    /// The numbers accepted, in SI.
    pub range: Option<Range>,
    /// The option that names the field of messages whose unit it has; empty if it has its own.
    pub compared_with: &'static str,
    /// The group of options of which at least one must be given; empty if it belongs to none.
    pub one_of: &'static str,
}

/// The type of an option that can be given as a string: any that is `From<&'static str>`, such as `String` and
/// `PathBuf`.
#[diagnostic::on_unimplemented(message = "expected `{Self}`, found a text", label = "a text, not `{Self}`")]
pub trait FromText {
    /// Converts the text.
    fn from_text(text: &'static str) -> Self;
}

/// The type of an option that can be given as the path of something that the robot declares: any that is `From<&'static str>`.
#[diagnostic::on_unimplemented(
    message = "expected `{Self}`, found a path",
    label = "a path; to name a field of its messages, write it after the path, as in `sensor::battery.voltage`"
)]
pub trait FromPath {
    /// Converts the path.
    fn from_path(path: &'static str) -> Self;
}

#[diagnostic::do_not_recommend]
impl<T: From<&'static str>> FromPath for T {
    fn from_path(path: &'static str) -> Self {
        path.into()
    }
}

#[diagnostic::do_not_recommend]
impl<T: From<&'static str>> FromText for T {
    fn from_text(text: &'static str) -> Self {
        text.into()
    }
}

/// The type of an option that can be given as a number with a unit; a time may also be a `Duration`.
#[diagnostic::on_unimplemented(
    message = "a number with a unit cannot be `{Self}`",
    label = "has a unit",
    note = "an option with a unit is an `f64`, an `f32`, a `Duration`, or an `Option` of one of these"
)]
pub trait FromQuantity {
    /// Converts the value in SI.
    fn from_quantity(value: f64) -> Self;
    /// Returns the value in SI, if there is one.
    fn to_quantity(&self) -> Option<f64>;
    /// The value for `null`, if the type has one.
    fn none() -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
    /// Converts a string in the SI unit, for types more exact than an `f64`.
    fn from_exact(_text: &str) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
    /// Returns the value in SI as decimal digits, for types more exact than an `f64`.
    fn to_exact(&self) -> Option<String> {
        None
    }
}

impl FromQuantity for f64 {
    fn from_quantity(value: f64) -> Self {
        value
    }

    fn to_quantity(&self) -> Option<f64> {
        Some(*self)
    }
}

impl FromQuantity for f32 {
    fn from_quantity(value: f64) -> Self {
        value as Self
    }

    fn to_quantity(&self) -> Option<f64> {
        Some(f64::from(*self))
    }
}

impl FromQuantity for Duration {
    /// Negative times become 0, and times too long the longest possible.
    fn from_quantity(seconds: f64) -> Self {
        let longest = if seconds > 0.0 { Self::MAX } else { Self::ZERO };
        Self::try_from_secs_f64(seconds).unwrap_or(longest)
    }

    fn to_quantity(&self) -> Option<f64> {
        Some(self.as_secs_f64())
    }

    /// Converts seconds with up to nine decimal places.
    fn from_exact(text: &str) -> Option<Self> {
        let (seconds, fraction) = text.split_once('.').unwrap_or((text, ""));
        let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        if fraction.len() > 9 || !are_digits(seconds) || !are_digits(fraction) {
            return None;
        }
        let nanos = format!("{fraction:0<9}").parse().ok()?;
        Some(Self::new(seconds.parse().ok()?, nanos))
    }

    fn to_exact(&self) -> Option<String> {
        let text = format!("{}.{:09}", self.as_secs(), self.subsec_nanos());
        Some(text.trim_end_matches('0').trim_end_matches('.').to_owned())
    }
}

impl<T: FromQuantity> FromQuantity for Option<T> {
    fn from_quantity(value: f64) -> Self {
        Some(T::from_quantity(value))
    }

    fn to_quantity(&self) -> Option<f64> {
        self.as_ref().and_then(T::to_quantity)
    }

    fn none() -> Option<Self> {
        Some(None)
    }

    fn from_exact(text: &str) -> Option<Self> {
        T::from_exact(text).map(Some)
    }

    fn to_exact(&self) -> Option<String> {
        self.as_ref().and_then(T::to_exact)
    }
}
