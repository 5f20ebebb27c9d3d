//! The default of a parameter has its type and is within its range; only numbers have a range, and it is not empty.
//!
//! Right: `beta: f64 = 0.1, range: 0.0..=1.0;`
//! Wrong: `beta: f64 = 2.0, range: 0.0..=1.0;`

use crate::diagnostics::Diagnostics;
use crate::model::{Parameter, Robot};
use crate::parse::{Literal, ParameterKind, ParameterRange, Value};
use std::cmp::Ordering;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for parameter in &robot.parameters {
        let fits = of_type(parameter, &parameter.default, diagnostics);
        let Some(range) = &parameter.range else { continue };
        if !matches!(parameter.kind, ParameterKind::Integer | ParameterKind::Number) {
            let message = format!("only numbers have a range; leave it out of `{}`", parameter.name);
            diagnostics.error(&range.word, message);
            continue;
        }
        let start_fits = of_type(parameter, &range.start, diagnostics);
        if of_type(parameter, &range.end, diagnostics) && start_fits {
            bounds(parameter, range, fits, diagnostics);
        }
    }
}

/// Returns whether a value has the parameter's type; if not, reports it.
fn of_type(parameter: &Parameter, literal: &Literal, diagnostics: &mut Diagnostics) -> bool {
    let (name, kind) = (&parameter.name, parameter.kind);
    let found = match (&literal.value, kind) {
        (Value::Bool(_), ParameterKind::Bool)
        | (Value::Integer(_), ParameterKind::Integer)
        | (Value::Number(_), ParameterKind::Number)
        | (Value::Text(_), ParameterKind::Text) => return true,
        (Value::Number(_), ParameterKind::Integer) if literal.has_unit => {
            let message = format!("an `i64` has no unit; leave it out, or make `{name}` an `f64`");
            diagnostics.at(literal.place, message);
            return false;
        }
        (Value::Number(number), ParameterKind::Integer) if number.fract() == 0.0 && number.abs() > 9e18 => {
            diagnostics.at(literal.place, "this does not fit into an `i64`, which has 64 bits".into());
            return false;
        }
        (Value::Bool(_), _) => "a `bool`",
        (Value::Text(_), _) => "a text",
        (Value::Integer(_), _) => "an integer",
        (Value::Number(_), ParameterKind::Integer) => "a number with a fraction",
        (Value::Number(_), _) => "a number",
    };
    let (article, kind) = (article(kind), kind.name());
    let message = format!("expected {article} `{kind}`, found {found}; change it, or the type of `{name}`");
    diagnostics.at(literal.place, message);
    false
}

fn article(kind: ParameterKind) -> &'static str {
    match kind {
        ParameterKind::Integer | ParameterKind::Number => "an",
        ParameterKind::Bool | ParameterKind::Text => "a",
    }
}

/// Values of several dimensions are reported by another rule.
fn bounds(parameter: &Parameter, range: &ParameterRange, fits: bool, diagnostics: &mut Diagnostics) {
    let (start, end, default) = (&range.start, &range.end, &parameter.default);
    if is_above(start, end) {
        let message = "this is below the start of the range; exchange the two";
        diagnostics.at(end.place, message.into());
    } else if fits && (is_above(start, default) || is_above(default, end)) {
        let message = format!("this default is outside the range of `{}`; change one of them", parameter.name);
        diagnostics.at(default.place, message);
    }
}

fn is_above(a: &Literal, b: &Literal) -> bool {
    let order = match (&a.value, &b.value) {
        (Value::Integer(a), Value::Integer(b)) => Some(a.cmp(b)),
        (Value::Number(a), Value::Number(b)) => a.partial_cmp(b),
        _ => None,
    };
    a.dimension == b.dimension && order == Some(Ordering::Greater)
}
