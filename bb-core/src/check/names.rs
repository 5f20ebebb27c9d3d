//! Checks of the names of declared inputs and outputs against those of the algorithm.

use super::find::{find_input, find_output};
use super::text::{Text, equal, nearest};
use crate::component::{Inputs, Outputs};
use crate::stub::UNKNOWN_INDEX;

/// Checks that the algorithm has the declared input `name`.
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

/// Checks that the algorithm has the declared output `name`.
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

/// Checks that the input `name`, which is declared as optional, is optional in the algorithm.
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

/// Checks that the algorithm handles inputs across moving joints.
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

pub(super) const fn list(mut text: Text, names: &[&str]) -> Text {
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
