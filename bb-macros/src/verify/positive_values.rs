//! Rates, times and the limits of speed and effort are positive, and counts are whole numbers in their range.
//!
//! Right: `rate: 200 Hz;`
//! Wrong: `rate: 0 Hz;`
//!
//! The bounds come from the table of the language. A URDF's limits of speed and effort may be 0.

use crate::diagnostics::Diagnostics;
use crate::language::Value;
use crate::model::Robot;
use crate::parse::Given;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for given in &robot.given {
        if let Some(fault) = fault(given) {
            diagnostics.at(given.quantity.place, fault);
        }
    }
}

/// The fault of a number; a wrong dimension is reported by another rule.
fn fault(given: &Given) -> Option<String> {
    let Given { word, joint, quantity } = given;
    match word.value {
        Value::Number(measure, bounds) => {
            let (dimension, _) = measure.in_joint(*joint)?;
            bounds.fault(quantity.value).filter(|_| quantity.dimension == dimension).map(str::to_owned)
        }
        Value::Count { .. } if quantity.has_unit => None,
        Value::Count { .. } if quantity.value.fract() != 0.0 => Some("this must be a whole number".to_owned()),
        Value::Count { lowest, .. } if quantity.value < f64::from(lowest) => {
            Some(format!("this must be at least {lowest}"))
        }
        Value::Count { highest, .. } if quantity.value > f64::from(highest) => {
            Some(format!("this must be at most {highest}"))
        }
        Value::Count { .. } | Value::Other => None,
    }
}
