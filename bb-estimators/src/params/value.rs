//! Values of parameters.

use core::fmt;
use core::ops::RangeInclusive;

/// The kinds of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Switch: on or off.
    Switch,
    /// Choice of one of these names.
    Choice(&'static [&'static str]),
    /// A natural number.
    Count,
    /// A real number, in SI.
    Number,
    /// A state that drifts randomly: standard deviation and correlation time.
    Process,
}

/// The value of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Value of a [`Kind::Switch`].
    Switch(bool),
    /// Word of a [`Kind::Choice`].
    Choice(&'static str),
    /// Value of a [`Kind::Count`].
    Count(u32),
    /// Value of a [`Kind::Number`], in the parameter's unit.
    Number(f64),
    /// Value of a [`Kind::Process`].
    Process {
        /// Standard deviation, in the parameter's unit.
        deviation: f64,
        /// Correlation time, s; infinite for a constant.
        time_s: f64,
    },
}

impl fmt::Display for Value {
    /// Writes the value as [`Params::set`](super::Params::set) reads it, without the unit.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Switch(switch) => write!(f, "{switch}"),
            Self::Choice(name) => f.write_str(name),
            Self::Count(count) => write!(f, "{count}"),
            Self::Number(number) => fmt_number(*number, f),
            Self::Process { deviation, time_s } => {
                fmt_number(*deviation, f)?;
                if time_s.is_infinite() {
                    return f.write_str(" for ever");
                }
                f.write_str(" for ")?;
                fmt_number(*time_s, f)?;
                f.write_str(" s")
            }
        }
    }
}

/// Writes a number in plain or in scientific notation, whichever is shorter.
fn fmt_number(number: f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let is_plain = number == 0.0 || !number.is_finite() || (1e-3..1e6).contains(&number.abs());
    if is_plain { write!(f, "{number}") } else { write!(f, "{number:e}") }
}

/// The accepted numbers, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least.
    pub min: f64,
    /// The greatest; may be infinite.
    pub max: f64,
}

impl Range {
    /// All numbers.
    pub const ALL: Self = Self { min: f64::NEG_INFINITY, max: f64::INFINITY };

    /// The first of `ranges`; all numbers if there is none.
    pub(crate) const fn stated(ranges: &[RangeInclusive<f64>]) -> Self {
        match ranges {
            [range, ..] => Self { min: *range.start(), max: *range.end() },
            [] => Self::ALL,
        }
    }

    /// Returns whether a number is in the range; NaN never is.
    pub(crate) const fn has(&self, value: f64) -> bool {
        self.min <= value && value <= self.max
    }
}

impl fmt::Display for Range {
    /// Writes `from 0 to 1000` or `from 1`; nothing for [`Range::ALL`].
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { min, max } = *self;
        match (min.is_finite(), max.is_finite()) {
            (false, false) => Ok(()),
            (true, false) => write!(f, "from {}", Value::Number(min)),
            (false, true) => write!(f, "to {}", Value::Number(max)),
            (true, true) => write!(f, "from {} to {}", Value::Number(min), Value::Number(max)),
        }
    }
}

/// A type that a parameter can have.
pub trait Field: Copy {
    /// Kind of the parameters of this type.
    const KIND: Kind;

    /// Converts the field to a value.
    fn to_value(self) -> Value;

    /// Converts a value of this kind to the field; `None` for another kind.
    fn from_value(value: Value) -> Option<Self>;
}

/// Implements [`Field`] for a type that is one variant of [`Value`].
macro_rules! field {
    ($type:ty, $variant:ident) => {
        impl Field for $type {
            const KIND: Kind = Kind::$variant;

            fn to_value(self) -> Value {
                Value::$variant(self)
            }

            fn from_value(value: Value) -> Option<Self> {
                if let Value::$variant(value) = value { Some(value) } else { None }
            }
        }
    };
}

field!(bool, Switch);
field!(u32, Count);
field!(f64, Number);
