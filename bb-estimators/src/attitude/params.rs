//! What is wrong with a parameter.

use core::error::Error;
use core::fmt;

/// A parameter outside the range that its algorithm accepts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamsError {
    /// The name of the field.
    pub parameter: &'static str,
    /// What it was set to.
    pub value: f64,
    /// The least accepted value, in the parameter's unit.
    pub min: f64,
    /// The greatest accepted value, in the parameter's unit.
    pub max: f64,
    /// The parameter's unit.
    pub unit: &'static str,
}

impl fmt::Display for ParamsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameter, value, min, max, unit } = self;
        write!(f, "`{parameter}` is {value} {unit}: choose a value from {min} to {max} {unit}")
    }
}

impl Error for ParamsError {}

/// Accepts `value` if it lies in `min..=max`; NaN and infinity never do.
pub(crate) fn accept(
    parameter: &'static str,
    value: f64,
    (min, max): (f64, f64),
    unit: &'static str,
) -> Result<(), ParamsError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(ParamsError { parameter, value, min, max, unit })
}
