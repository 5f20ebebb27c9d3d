//! Whether the options given to a component are complete, of the right dimension and in range.

use super::text::{Text, contains, equal};
use crate::component::{OptionField, Options};
use crate::declaration::Dimension;

/// Checks the range of an option given as a number without a unit, and that it has none. Unknown names are left to rustc.
///
/// The arguments of the checks are passed by value: rustc makes a constant of its own of each reference in a constant.
#[track_caller]
pub const fn check_number<O: Options>(component: &str, name: &str, number: f64) {
    check_given(component, O::FIELDS, name, None, number);
}

/// Checks the dimension and the range of an option given as a number with a unit; `number` is in SI.
#[track_caller]
pub const fn check_quantity<O: Options>(
    component: &str,
    name: &str,
    number: f64,
    exponents: [i8; 6],
    dimension: &'static str,
) {
    check_given(component, O::FIELDS, name, Some(Dimension { exponents, name: dimension }), number);
}

#[track_caller]
const fn check_given(
    component: &str,
    fields: &[OptionField],
    name: &str,
    dimension: Option<Dimension>,
    number: f64,
) {
    let mut index = 0;
    while index < fields.len() {
        let field = &fields[index];
        if equal(field.name, name) {
            check_dimension(component, field, dimension.as_ref());
            check_range(component, field, number);
            return;
        }
        index += 1;
    }
}

/// Checks that every required option is given.
#[track_caller]
pub const fn check_required<O: Options, const N: usize>(component: &str, given: [&str; N]) {
    if let Some(field) = missing_option(O::FIELDS, &given) {
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
const fn check_dimension(component: &str, field: &OptionField, given: Option<&Dimension>) {
    match (&field.dimension, given) {
        (Some(expected), Some(found)) if !expected.equals(found) => {
            let text = Text::new("expected ").push(expected.name).push(", found ").push(found.name);
            let text = text.push("; ").name(field.name).push(" of ").name(component);
            panic!("{}", text.push(" is in ").push(field.unit).as_str())
        }
        (Some(expected), None) => {
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
const fn check_range(component: &str, field: &OptionField, number: f64) {
    if let Some(range) = &field.range
        && !(number >= range.start && number <= range.end)
    {
        let text = Text::new("").name(field.name).push(" of ").name(component).push(" must be in ");
        let text = text.push(range.text);
        let text = if field.unit.is_empty() { text } else { text.push(" ").push(field.unit) };
        panic!("{}", text.as_str())
    }
}
