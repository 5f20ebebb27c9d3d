//! Values of parameters as text.

use super::units::{self, Quantity};
use super::{Kind, Parameter, SetError, Value};

/// Parses `text` as a value of a parameter that has the value `now`.
pub(super) fn parse<'t>(
    parameter: &'static Parameter,
    text: &'t str,
    now: Option<Value>,
) -> Result<Value, SetError<'t>> {
    let text = text.trim();
    let no_value = || SetError::NoValue { parameter, text };
    match parameter.kind {
        Kind::Switch => text.parse().map(Value::Switch).map_err(|_| no_value()),
        Kind::Choice(names) => {
            names.iter().find(|name| **name == text).map(|name| Value::Choice(name)).ok_or_else(no_value)
        }
        Kind::Count => text.parse().map(Value::Count).map_err(|_| no_value()),
        Kind::Number => number(parameter, text, text).map(Value::Number),
        Kind::Process => {
            let (deviation, time_s) = match (text.split_once(" for "), now) {
                (Some((deviation, time)), _) if time.trim() == "ever" => (deviation, f64::INFINITY),
                (Some((deviation, time)), _) => match units::quantity(time, "s") {
                    Quantity::Number(time_s) => (deviation, time_s),
                    _ => return Err(no_value()),
                },
                (None, Some(Value::Process { time_s, .. })) => (text, time_s),
                (None, _) => return Err(no_value()),
            };
            Ok(Value::Process { deviation: number(parameter, deviation, text)?, time_s })
        }
    }
}

/// A number with or without a unit, out of the whole `text`.
fn number<'t>(parameter: &'static Parameter, number: &str, text: &'t str) -> Result<f64, SetError<'t>> {
    match units::quantity(number, parameter.unit) {
        Quantity::Number(number) => Ok(number),
        Quantity::OtherUnit => Err(SetError::OtherUnit { parameter, text }),
        Quantity::None => Err(SetError::NoValue { parameter, text }),
    }
}
