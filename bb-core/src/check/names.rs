//! Whether declared inputs and outputs are the algorithm's, by name.

use super::text::{Text, equal, nearest};
use crate::component::InputField;

/// The number of the field that takes the declared input `name`; a single payload takes an input of any name.
#[track_caller]
pub const fn input_index(estimator: &str, fields: &[InputField], name: &str) -> usize {
    let mut index = 0;
    while index < fields.len() {
        if equal(fields[index].name, name) {
            return index;
        }
        index += 1;
    }
    if fields.is_empty() {
        return 0;
    }
    let mut names = [""; 64];
    let mut count = 0;
    while count < fields.len() && count < 64 {
        names[count] = fields[count].name;
        count += 1;
    }
    let (names, _) = names.split_at(count);
    unknown(Text::new("").name(estimator).push(" has no input ").name(name).push("; it takes "), names, name)
}

/// The number of the field that holds the declared output `name`.
#[track_caller]
pub const fn output_index(estimator: &str, fields: &[&str], name: &str) -> usize {
    let mut index = 0;
    while index < fields.len() {
        if equal(fields[index], name) {
            return index;
        }
        index += 1;
    }
    if fields.is_empty() && equal(name, "out") {
        return 0;
    }
    let start = Text::new("").name(estimator).push(" has no output ").name(name);
    if fields.is_empty() {
        let text = start.push("; its only one is `out`, which needs no declaration");
        panic!("{}", text.as_str())
    }
    unknown(start.push("; it emits "), fields, name)
}

/// An input as declared in `robot!`.
#[derive(Clone, Copy, Debug)]
pub struct Declared {
    /// Its name.
    pub name: &'static str,
    /// Whether it is `optional`.
    pub optional: bool,
}

/// That every input the algorithm cannot do without is declared, and none of them as optional.
#[track_caller]
pub const fn check_inputs(estimator: &str, fields: &[InputField], declared: &[Declared]) {
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
            if equal(declared[number].name, field.name) {
                found = true;
                if declared[number].optional && !field.optional {
                    let text = Text::new("").name(estimator).push(" cannot do without its input ").name(field.name);
                    panic!("{}", text.push("; leave out `optional`").as_str())
                }
            }
            number += 1;
        }
        if !found {
            let text = Text::new("").name(estimator).push(" needs an input ").name(field.name);
            let text = text.push("; declare it: `input ").push(field.name).push(": …;`");
            panic!("{}", text.as_str())
        }
        index += 1;
    }
}

/// The number of the field that takes what the parent sensor of a nested estimator publishes: the only one that the
/// algorithm cannot do without.
#[track_caller]
pub const fn nested_index(estimator: &str, fields: &[InputField]) -> usize {
    let mut only = None;
    let mut index = 0;
    while index < fields.len() {
        if !fields[index].optional {
            if only.is_some() {
                let text =
                    Text::new("").name(estimator).push(" needs several inputs, and a nested estimator has one; ");
                panic!("{}", text.push("declare it on the link, with an `input` for each").as_str())
            }
            only = Some(index);
        }
        index += 1;
    }
    match only {
        Some(index) => index,
        None => 0,
    }
}

/// That an algorithm of several outputs has at least one declared.
#[track_caller]
pub const fn check_outputs(estimator: &str, fields: &[&str]) {
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
