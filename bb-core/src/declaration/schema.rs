//! The JSON Schema of a parameter, and of the numbers and quantities in it.

use super::{ParameterDeclaration, ParameterDefault, Range};
use crate::message::codec::to_json;
use bb_message::__private::member;

/// The schema of a parameter's value.
pub(crate) fn parameter_schema(declared: &ParameterDeclaration) -> String {
    let (keywords, default) = match declared.default {
        ParameterDefault::Bool(value) => (member("type", "boolean"), value.to_string()),
        ParameterDefault::Integer(value) => (number("integer", declared.range), value.to_string()),
        ParameterDefault::Text(value) => (member("type", "string"), to_json(&value.to_owned())),
        ParameterDefault::Float(value) if declared.unit.is_empty() => {
            (number("number", declared.range), to_json(&value))
        }
        ParameterDefault::Float(value) => (quantity(declared.unit), to_json(&format!("{value} {}", declared.unit))),
    };
    // The range of a parameter is written with its units.
    with_notes(keywords, declared.doc, "", declared.range, Some(&default))
}

/// A schema with these keywords and what is known of the value.
pub(crate) fn with_notes(
    keywords: String,
    doc: &str,
    unit: &str,
    range: Option<Range>,
    default: Option<&str>,
) -> String {
    let mut description = doc.trim().to_owned();
    if let Some(range) = range {
        let separator = if description.is_empty() { "" } else { " " };
        description = format!("{description}{separator}In {} {unit}", range.text).trim_end().to_owned() + ".";
    }
    let mut all = vec![keywords];
    if !description.is_empty() {
        all.push(member("description", &description));
    }
    all.extend(default.filter(|default| *default != "null").map(|default| format!(r#""default":{default}"#)));
    format!("{{{}}}", all.join(","))
}

/// A string of a number and a unit; whether the unit has the right dimension is checked when it is read.
pub(crate) fn quantity(unit: &str) -> String {
    // The number is followed by a unit; no unit begins with a character that could continue the number.
    let pattern = r"^\s*[-+]?([0-9][0-9_]*\.?[0-9_]*|\.[0-9][0-9_]*)([eE][-+]?[0-9]+)?\s*[^\s0-9._+\-eE].*$";
    format!(
        "{},{},\"examples\":[{}]",
        member("type", "string"),
        member("pattern", pattern),
        to_json(&format!("1 {unit}"))
    )
}

/// A number within a range.
pub(crate) fn number(kind: &str, range: Option<Range>) -> String {
    let limits = range.map_or(String::new(), |range| {
        // JSON has no infinity.
        let limit = |name, value: f64| {
            if value.is_finite() { format!(r#","{name}":{}"#, to_json(&value)) } else { String::new() }
        };
        limit("minimum", range.start) + &limit("maximum", range.end)
    });
    member("type", kind) + &limits
}
