//! Typed options with defaults, ranges, units and docs.

use super::Setting;
use crate::declaration::{Dimension, Range};
use std::time::Duration;

/// The options of a sensor or an estimator: a plain struct, filled from the parentheses in `robot!`.
///
/// Derive it. Every field has either a default or is `required` (its type is then `Default`, which stands in until it is
/// given). A field may be of any type. An `f64`, an `f32`, a `Duration` or an `Option` of one of these may state a unit:
/// a literal in `robot!` must then carry one of that dimension, and arrives in SI; a `Duration` is a time without saying
/// so. A number may state a range, which a literal must keep. Values that are no literals, a constant say, are
/// taken as they are and validated at the start.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Options of a range finder.
/// #[derive(Clone, Debug, Options)]
/// pub struct RangeFinderOptions {
///     /// Device file.
///     #[option(required)]
///     pub port: String,
///     /// Readings beyond it are dropped. Unit: m.
///     #[option(default = 4.0, range = 0.1..=30.0, unit = "m")]
///     pub maximum_range: f64,
/// }
///
/// assert_eq!(RangeFinderOptions::defaults().maximum_range, 4.0);
/// assert!(RangeFinderOptions { maximum_range: 99.0, ..RangeFinderOptions::defaults() }.validate().is_err());
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an options struct",
    label = "cannot be the options of a component",
    note = "derive it: `#[derive(Clone, Debug, Options)]`, with `#[option(default = …)]` on each field"
)]
pub trait Options: Clone + std::fmt::Debug + Send + 'static {
    /// What is known of each option, in the order of the fields.
    const FIELDS: &'static [OptionField];

    /// All defaults; a required option is at its type's `Default`.
    fn defaults() -> Self;

    /// Checks every range. The error names the option, its value and what is accepted.
    fn validate(&self) -> Result<(), String>;

    /// The option number `index` of [`Options::FIELDS`], for settings that are read at run time.
    #[doc(hidden)]
    fn setting(&mut self, _index: usize) -> Option<Box<dyn Setting + '_>> {
        None
    }
}

/// What is known of one option.
#[derive(Clone, Copy, Debug)]
pub struct OptionField {
    /// Its name.
    pub name: &'static str,
    /// Its doc comment.
    pub doc: &'static str,
    /// Whether it must be given.
    pub required: bool,
    /// Its dimension, where a unit is stated.
    pub dimension: Option<Dimension>,
    /// The unit it was stated in.
    pub unit: &'static str,
    /// The numbers accepted, in SI.
    pub range: Option<Range>,
}

/// For components without options.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoOptions;

impl Options for NoOptions {
    const FIELDS: &'static [OptionField] = &[];
    fn defaults() -> Self {
        Self
    }
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

/// What a text given as an option may become: whatever is `From<&'static str>`, as `String` and `PathBuf` are.
#[diagnostic::on_unimplemented(message = "expected `{Self}`, found a text", label = "a text, not `{Self}`")]
pub trait FromText {
    /// It.
    fn from_text(text: &'static str) -> Self;
}

#[diagnostic::do_not_recommend]
impl<T: From<&'static str>> FromText for T {
    fn from_text(text: &'static str) -> Self {
        text.into()
    }
}

/// What a number with a unit given as an option may become; a time is a `Duration` as well.
#[diagnostic::on_unimplemented(
    message = "a number with a unit cannot be `{Self}`",
    label = "has a unit",
    note = "an option with a unit is an `f64`, an `f32`, a `Duration`, or an `Option` of one of these"
)]
pub trait FromQuantity {
    /// From its value in SI.
    fn from_quantity(value: f64) -> Self;
    /// Its value in SI, if it has one.
    fn to_quantity(&self) -> Option<f64>;
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
    /// Negative times are 0, and too long ones the longest there is.
    fn from_quantity(seconds: f64) -> Self {
        let longest = if seconds > 0.0 { Self::MAX } else { Self::ZERO };
        Self::try_from_secs_f64(seconds).unwrap_or(longest)
    }

    fn to_quantity(&self) -> Option<f64> {
        Some(self.as_secs_f64())
    }
}

impl<T: FromQuantity> FromQuantity for Option<T> {
    fn from_quantity(value: f64) -> Self {
        Some(T::from_quantity(value))
    }

    fn to_quantity(&self) -> Option<f64> {
        self.as_ref().and_then(T::to_quantity)
    }
}
