//! Checks that the options given to a component are complete, of the right dimension and in range.

use super::text::{Text, contains, equal};
use crate::component::{OptionField, Options};
use crate::declaration::Dimension;
use crate::message::Payload;
use crate::message::codec::{FieldUnit, Shape};

/// Checks an option given as a number without a unit: its range, and that it needs no unit. Unknown names are left to rustc.
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
            if field.compared_with.is_empty() {
                check_dimension(component, field, dimension.as_ref());
            }
            check_range(component, field, number);
            return;
        }
        index += 1;
    }
}

/// Checks that an option has the unit of the field that the option `of` names, if it is compared with that field.
#[track_caller]
pub const fn check_compared<O: Options, P: Payload, const N: usize>(
    component: &str,
    name: &str,
    of: &str,
    names: [&str; N],
    has_unit: bool,
    exponents: [i8; 6],
    dimension: &'static str,
) {
    let mut index = 0;
    while index < O::FIELDS.len() {
        let field = &O::FIELDS[index];
        if equal(field.name, name) && equal(field.compared_with, of) {
            let given = if has_unit { Some(Dimension { exponents, name: dimension }) } else { None };
            if let Some(units) = units_of(&P::SHAPE, &names) {
                check_units(component, name, P::NAME, &names, units, given);
            }
        }
        index += 1;
    }
}

/// The units of a field, or of the nearest around it that states any. `None` if the payload has no such field, which rustc reports.
const fn units_of(shape: &Shape, names: &[&str]) -> Option<&'static [FieldUnit]> {
    let mut shape = *shape;
    let mut depth = 0;
    while depth < names.len() {
        let Shape::Struct(inner) = shape else { break };
        let (mut index, mut found) = (0, false);
        while index < inner.fields.len() {
            let field = &inner.fields[index];
            if equal(field.name, names[depth]) {
                if !field.units.is_empty() {
                    return Some(field.units);
                }
                shape = field.shape;
                found = true;
            }
            index += 1;
        }
        if !found {
            break;
        }
        depth += 1;
    }
    if depth == 0 { None } else { Some(&[]) }
}

#[track_caller]
const fn check_units(
    component: &str,
    name: &str,
    payload: &str,
    names: &[&str],
    units: &[FieldUnit],
    given: Option<Dimension>,
) {
    let mut index = 0;
    while index < units.len() {
        if let Some(given) = &given
            && given.equals(&Dimension { exponents: units[index].exponents, name: "" })
        {
            return;
        }
        index += 1;
    }
    let text = match (units, given) {
        ([], None) => return,
        ([], Some(given)) => {
            let text = Text::new("found ").push(given.name).push(", and ");
            let text = path(text, names).push(" of ").name(payload);
            text.push(" states no unit; leave the unit out, or state that of the field: `#[payload(unit = \"…\")]`")
        }
        ([first, ..], given) => {
            let text = Text::new("expected ").push(first.dimension);
            let text = match units {
                [_, second, ..] => text.push(" or ").push(second.dimension),
                _ => text,
            };
            match given {
                Some(given) => {
                    let text =
                        text.push(", found ").push(given.name).push("; ").name(name).push(" of ").name(component);
                    let text = path(text.push(" is compared with "), names).push(" of ").name(payload);
                    text.push(", which is in ").push(first.symbol)
                }
                None => {
                    let text = text.push(", found a number without a unit; write it with one, as in `1 ");
                    text.push(first.symbol).push("`")
                }
            }
        }
    };
    panic!("{}", text.as_str())
}

/// Appends `` `angular_velocity.x` ``.
const fn path(text: Text, names: &[&str]) -> Text {
    let (mut text, mut index) = (text.push("`"), 0);
    while index < names.len() {
        text = if index > 0 { text.push(".") } else { text };
        text = text.push(names[index]);
        index += 1;
    }
    text.push("`")
}

/// Checks that every required option is given, and one of each group.
#[track_caller]
pub const fn check_required<O: Options, const N: usize>(component: &str, given: [&str; N]) {
    if let Some(field) = missing_option(O::FIELDS, &given) {
        panic!("{}", describe_missing(Text::new(""), component, field).as_str())
    }
    let mut index = 0;
    while index < O::FIELDS.len() {
        let group = O::FIELDS[index].one_of;
        if !group.is_empty() && !has_one_of(O::FIELDS, group, &given) {
            let text = Text::new("").name(component).push(" needs one of the options ");
            panic!("{}", names_of_group(text, O::FIELDS, group).as_str())
        }
        index += 1;
    }
}

/// Returns whether an option of the group is given.
const fn has_one_of(fields: &[OptionField], group: &str, given: &[&str]) -> bool {
    let mut index = 0;
    while index < fields.len() {
        if equal(fields[index].one_of, group) && contains(given, fields[index].name) {
            return true;
        }
        index += 1;
    }
    false
}

const fn names_of_group(mut text: Text, fields: &[OptionField], group: &str) -> Text {
    let (mut index, mut is_first) = (0, true);
    while index < fields.len() {
        if equal(fields[index].one_of, group) {
            text = if is_first { text } else { text.push(", ") };
            text = text.name(fields[index].name);
            is_first = false;
        }
        index += 1;
    }
    text
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
