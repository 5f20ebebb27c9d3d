//! Every quantity has the dimension expected in its place.
//!
//! Right: `sync_tolerance: 20 ms;`
//! Wrong: `sync_tolerance: 20 m;`
//!
//! The dimensions come from the table of the language. The options of components are checked against their types by
//! `bb_core`.

use crate::diagnostics::Diagnostics;
use crate::language::Value as Expected;
use crate::model::{Parameter, Robot};
use crate::parse::{Given, ParameterKind, Value};
use crate::units::Dimension;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for given in &robot.given {
        if let Some(fault) = fault(given) {
            diagnostics.at(given.quantity.place, fault);
        }
    }
    for parameter in robot.parameters.iter().filter(|parameter| parameter.kind == ParameterKind::Number) {
        range(parameter, diagnostics);
    }
}

fn fault(given: &Given) -> Option<String> {
    let Given { word, joint, quantity } = given;
    let (expected, example) = match word.value {
        Expected::Number(measure, _) => measure.in_joint(*joint)?,
        Expected::Count { .. } => (Dimension::NONE, None),
        Expected::Other => return None,
    };
    if quantity.dimension == expected {
        return None;
    }
    let (expected, example) = (expected.name(), example.unwrap_or_else(|| word.number()));
    Some(if quantity.has_unit {
        format!("expected {expected}, found {}; write it as in `{example}`", quantity.dimension.name())
    } else {
        format!("expected {expected}, found a number without a unit; write it as in `{example}`")
    })
}

/// The ends of a range have the default's dimension.
fn range(parameter: &Parameter, diagnostics: &mut Diagnostics) {
    let default = &parameter.default;
    for end in parameter.range.iter().flat_map(|range| [&range.start, &range.end]) {
        let are_numbers = [default, end].iter().all(|literal| matches!(literal.value, Value::Number(_)));
        if are_numbers && end.dimension != default.dimension {
            let expected = default.dimension.name();
            let found = if end.has_unit { end.dimension.name() } else { "a number without a unit".into() };
            let message = format!("the default is {expected} and this is {found}; write both in units of one kind");
            diagnostics.at(end.place, message);
        }
    }
}
