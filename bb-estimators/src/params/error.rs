//! Errors of parameters.

use core::error::Error;
use core::fmt;

use super::{Kind, Parameter, Range, Value, nearest};

/// A parameter outside the range that its algorithm accepts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamsError {
    /// The name of the field.
    pub parameter: &'static str,
    /// Value that was refused.
    pub value: f64,
    /// The least accepted value, in the parameter's unit.
    pub min: f64,
    /// The greatest accepted value, in the parameter's unit; may be infinite.
    pub max: f64,
    /// The parameter's unit; empty for plain numbers.
    pub unit: &'static str,
}

impl fmt::Display for ParamsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameter, value, min, max, unit } = *self;
        let unit = Unit(unit);
        write!(f, "`{parameter}` is {}{unit}: choose a value {}{unit}", Value::Number(value), Range { min, max })
    }
}

impl Error for ParamsError {}

/// Reason for which a parameter was not set. Nothing has changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SetError<'t> {
    /// There is no parameter of this name.
    Unknown {
        /// Name that was given.
        name: &'t str,
        /// Parameters that exist.
        parameters: &'static [Parameter],
    },
    /// The text is not a value of the parameter's kind.
    NoValue {
        /// The parameter.
        parameter: &'static Parameter,
        /// The text.
        text: &'t str,
    },
    /// The text has a unit that is not one of the parameter's dimension.
    OtherUnit {
        /// The parameter.
        parameter: &'static Parameter,
        /// The text.
        text: &'t str,
    },
    /// The value is outside the range.
    Refused(ParamsError),
}

impl fmt::Display for SetError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Unknown { name, parameters } => {
                write!(f, "there is no parameter `{name}`; ")?;
                if let Some(near) = nearest(name, parameters.iter().map(|parameter| parameter.name)) {
                    return write!(f, "did you mean `{near}`?");
                }
                f.write_str("choose one of ")?;
                for (index, parameter) in parameters.iter().enumerate() {
                    write!(f, "{}`{}`", if index > 0 { ", " } else { "" }, parameter.name)?;
                }
                Ok(())
            }
            Self::NoValue { parameter, text } => {
                let Parameter { name, kind, range, unit, .. } = *parameter;
                let unit = Unit(unit);
                write!(f, "`{name}` is `{text}`: ")?;
                match kind {
                    Kind::Switch => f.write_str("write `true` or `false`"),
                    Kind::Choice(names) => {
                        f.write_str("write ")?;
                        for (index, name) in names.iter().enumerate() {
                            let separator = match names.len() - index {
                                _ if index == 0 => "",
                                1 => " or ",
                                _ => ", ",
                            };
                            write!(f, "{separator}`{name}`")?;
                        }
                        Ok(())
                    }
                    Kind::Count => f.write_str("write a whole number from 0"),
                    Kind::Number => write!(f, "write a number {range}{unit}"),
                    Kind::Process => {
                        write!(
                            f,
                            "write a deviation {range}{unit} and its time, as `0.1 for 20 s` or `0.1 for ever`"
                        )
                    }
                }
            }
            Self::OtherUnit { parameter, text } => {
                let Parameter { name, range, unit, .. } = *parameter;
                match unit {
                    "" => write!(f, "`{name}` is `{text}`: it has no unit; choose a value {range}"),
                    unit => write!(f, "`{name}` is `{text}`: its unit is {unit}; choose a value {range} {unit}"),
                }
            }
            Self::Refused(error) => error.fmt(f),
        }
    }
}

impl Error for SetError<'_> {}

/// A unit after a number, with the space before it.
struct Unit(&'static str);

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() { Ok(()) } else { write!(f, " {}", self.0) }
    }
}
