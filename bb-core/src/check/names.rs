//! Whether declared inputs and outputs are the algorithm's, by name.

use super::find::{find_input, find_nested, find_output};
use super::text::{Text, equal, nearest};
use crate::component::{Inputs, Outputs};
use crate::stub::UNKNOWN_INDEX;

/// That the algorithm has the declared input `name`.
#[track_caller]
pub const fn check_input<I: Inputs>(estimator: &str, name: &str) {
    if !I::KNOWN || find_input::<I>(name) != UNKNOWN_INDEX {
        return;
    }
    let mut names = [""; 64];
    let mut count = 0;
    while count < I::FIELDS.len() && count < 64 {
        names[count] = I::FIELDS[count].name;
        count += 1;
    }
    let (names, _) = names.split_at(count);
    unknown(Text::new("").name(estimator).push(" has no input ").name(name).push("; it takes "), names, name)
}

/// That the algorithm has the declared output `name`.
#[track_caller]
pub const fn check_output<O: Outputs>(estimator: &str, name: &str) {
    if !O::KNOWN || find_output::<O>(name) != UNKNOWN_INDEX {
        return;
    }
    let start = Text::new("").name(estimator).push(" has no output ").name(name);
    if O::FIELDS.is_empty() {
        let text = start.push("; its only one is `out`, which needs no declaration");
        panic!("{}", text.as_str())
    }
    unknown(start.push("; it emits "), O::FIELDS, name)
}

/// That the algorithm can do without the input `name`, which is declared as optional.
#[track_caller]
pub const fn check_optional<I: Inputs>(estimator: &str, name: &str) {
    let fields = I::FIELDS;
    let mut index = 0;
    while index < fields.len() {
        if equal(fields[index].name, name) && !fields[index].optional {
            let text = Text::new("").name(estimator).push(" cannot do without its input ").name(name);
            panic!("{}", text.push("; leave out `optional`").as_str())
        }
        index += 1;
    }
}

/// That every input the algorithm cannot do without is among the `declared`.
#[track_caller]
pub const fn check_inputs<I: Inputs>(estimator: &str, declared: &[&str]) {
    if !I::KNOWN {
        return;
    }
    let fields = I::FIELDS;
    let mut misspelt = false;
    let mut number = 0;
    while number < declared.len() {
        misspelt = misspelt || find_input::<I>(declared[number]) == UNKNOWN_INDEX;
        number += 1;
    }
    if fields.is_empty() && declared.len() > 1 {
        let text = Text::new("").name(estimator).push(" takes a single input; leave out all but one");
        panic!("{}", text.as_str())
    }
    let mut index = 0;
    while index < fields.len() {
        let field = fields[index];
        let mut found = field.optional;
        let mut number = 0;
        while number < declared.len() {
            found = found || equal(declared[number], field.name);
            number += 1;
        }
        // A misspelt name is reported as such, and may stand for this one.
        if !found && !misspelt {
            let text = Text::new("").name(estimator).push(" needs an input ").name(field.name);
            let text = text.push("; declare it: `input ").push(field.name).push(": …;`");
            panic!("{}", text.as_str())
        }
        index += 1;
    }
}

/// That a nested estimator has exactly one input that it cannot do without, or only one: its sensor.
#[track_caller]
pub const fn check_nested<I: Inputs>(estimator: &str) {
    if !I::KNOWN || find_nested::<I>() != UNKNOWN_INDEX {
        return;
    }
    let fields = I::FIELDS;
    let (mut needed, mut index) = (0, 0);
    while index < fields.len() {
        needed += if fields[index].optional { 0 } else { 1 };
        index += 1;
    }
    let text = Text::new("").name(estimator);
    let text = if needed > 1 {
        text.push(" needs several inputs, and a nested estimator has one; ")
    } else {
        text.push(" needs none of its several inputs, and which of them the sensor feeds cannot be told; ")
    };
    panic!("{}", text.push("declare it on the link, with an `input` for each").as_str())
}

/// That an algorithm of several outputs has at least one declared.
#[track_caller]
pub const fn check_outputs<O: Outputs>(estimator: &str) {
    let fields = O::FIELDS;
    if !fields.is_empty() {
        let text =
            Text::new("").name(estimator).push(" has several outputs; declare the ones to publish, `output ");
        panic!("{}", list(text.push(fields[0]).push(";`, of "), fields).as_str())
    }
}

/// That the algorithm handles inputs across moving joints.
#[track_caller]
pub const fn check_dynamic(estimator: &str, handles: bool, input: &str, joint: &str, kind: &str) {
    if !handles {
        let text = Text::new("input ").name(input).push(" spans the moving joint ").name(joint).push(" (");
        let text = text.push(kind).push("), and ").name(estimator).push(" takes fixed transforms only; ");
        let text = text.push("declare it on a link that moves with this input, ");
        let text = text.push("or set `HANDLES_MOVING_JOINTS` in its `Estimator`");
        panic!("{}", text.as_str())
    }
}

const fn list(mut text: Text, names: &[&str]) -> Text {
    let mut index = 0;
    while index < names.len() {
        text = if index > 0 { text.push(", ") } else { text };
        text = text.name(names[index]);
        index += 1;
    }
    text
}

#[track_caller]
const fn unknown(text: Text, names: &[&str], name: &str) -> ! {
    let mut text = list(text, names);
    if let Some(near) = nearest(names, name) {
        text = text.push("; did you mean ").name(names[near]).push("?");
    }
    panic!("{}", text.as_str())
}
