//! Whether the options given to a component are complete, of the right dimension and in range.

use super::text::{Text, contains, equal};
use crate::component::OptionField;
use crate::declaration::Dimension;

/// One option as written in `robot!`.
#[derive(Clone, Copy, Debug)]
pub struct Given {
    /// Its name.
    pub name: &'static str,
    /// The dimension of its unit, if it is a number with a unit.
    pub dimension: Option<Dimension>,
    /// Its number in SI, if it is a literal number.
    pub number: Option<f64>,
}

/// Checks the dimension and the range of a given option. Unknown names are left to rustc.
#[track_caller]
pub const fn check_option(component: &str, fields: &[OptionField], given: Given) {
    let mut index = 0;
    while index < fields.len() {
        let field = &fields[index];
        if equal(field.name, given.name) {
            check_dimension(component, field, &given);
            check_range(component, field, &given);
            return;
        }
        index += 1;
    }
}

/// Checks that every required option is given.
#[track_caller]
pub const fn check_required(component: &str, fields: &[OptionField], given: &[&str]) {
    if let Some(field) = missing_option(fields, given) {
        panic!("{}", describe_missing(Text::new(""), component, field).as_str())
    }
}

/// The first required option that is not given.
pub(super) const fn missing_option<'a>(fields: &'a [OptionField], given: &[&str]) -> Option<&'a OptionField> {
    let mut index = 0;
    while index < fields.len() {
        let field = &fields[index];
        if field.required && !contains(given, field.name) {
            return Some(field);
        }
        index += 1;
    }
    None
}

/// The error text for a missing option.
pub(super) const fn describe_missing(text: Text, component: &str, field: &OptionField) -> Text {
    let text = text.name(component).push(" needs the option ").name(field.name);
    text.push("; give it: `").push(component).push("(").push(field.name).push(" = …)`")
}

#[track_caller]
const fn check_dimension(component: &str, field: &OptionField, given: &Given) {
    match (&field.dimension, &given.dimension) {
        (Some(expected), Some(found)) if !expected.equals(found) => {
            let text = Text::new("expected ").push(expected.name).push(", found ").push(found.name);
            let text = text.push("; ").name(field.name).push(" of ").name(component);
            panic!("{}", text.push(" is in ").push(field.unit).as_str())
        }
        (Some(expected), None) if given.number.is_some() => {
            let text = Text::new("expected ").push(expected.name).push(", found a number without a unit; ");
            panic!("{}", text.push("write it with one, as in `1 ").push(field.unit).push("`").as_str())
        }
        (None, Some(found)) => {
            let text = Text::new("expected a plain value, found ").push(found.name).push("; leave the unit out");
            panic!("{}", text.as_str())
        }
        _ => {}
    }
}

#[track_caller]
const fn check_range(component: &str, field: &OptionField, given: &Given) {
    if let (Some(range), Some(number)) = (&field.range, given.number)
        && !(number >= range.start && number <= range.end)
    {
        let text = Text::new("").name(field.name).push(" of ").name(component).push(" must be in ");
        let text = text.push(range.text);
        let text = if field.unit.is_empty() { text } else { text.push(" ").push(field.unit) };
        panic!("{}", text.as_str())
    }
}
