//! Checks that an estimator's declaration is complete.

use super::find::find_input;
use super::names::list;
use super::options::{describe_missing, missing_option};
use super::text::{Text, contains};
use crate::component::{Estimator, Inputs, OptionField, Options, Outputs, TakenAt};
use crate::stub::UNKNOWN_INDEX;

/// A fault in the inputs of an estimator.
#[derive(Clone, Copy)]
enum InputFault {
    /// The algorithm takes one input, but several are declared.
    Single,
    /// A required input is not declared.
    Missing(&'static str),
    /// The estimator is nested, but its algorithm needs several inputs.
    NeedsSeveral,
    /// The estimator is nested, but its algorithm requires none of its several inputs.
    NeedsNone,
}

/// Checks that an estimator has its required options among `given`, its required inputs among `declared`, and an
/// output if it has several.
///
/// Everything missing is reported in one message, since it is reported at one token. The text is built only if
/// something is missing: rustc interprets these functions for each estimator of each robot.
#[track_caller]
pub const fn check_estimator<E: Estimator, const G: usize, const D: usize>(
    estimator: &str,
    given: [&str; G],
    declared: [&str; D],
    has_outputs: bool,
) {
    let option = missing_option(<E::Options as Options>::FIELDS, &given);
    report::<E>(estimator, option, missing_input::<E::Input>(&declared), has_outputs);
}

/// Checks a nested estimator, whose only input is its sensor's, as [`check_estimator`] does.
#[track_caller]
pub const fn check_nested<E: Estimator, const G: usize>(estimator: &str, given: [&str; G], has_outputs: bool) {
    let option = missing_option(<E::Options as Options>::FIELDS, &given);
    report::<E>(estimator, option, no_nested_input::<E::Input>(), has_outputs);
}

#[track_caller]
const fn report<E: Estimator>(
    estimator: &str,
    option: Option<&OptionField>,
    input: Option<InputFault>,
    has_outputs: bool,
) {
    let outputs = <E::Output as Outputs>::FIELDS;
    let lacks_output = !has_outputs && !outputs.is_empty();
    if option.is_some() || input.is_some() || lacks_output {
        let text = Text::new("");
        let text = if let Some(option) = option { describe_missing(text, estimator, option) } else { text };
        let text = if let Some(fault) = input { describe_input(and(text), estimator, fault) } else { text };
        let text = if lacks_output { describe_outputs(and(text), estimator, outputs) } else { text };
        panic!("{}", text.as_str())
    }
}

const fn and(text: Text) -> Text {
    if text.as_str().is_empty() { text } else { text.push("; and ") }
}

/// The first required input that is not declared.
const fn missing_input<I: Inputs>(declared: &[&str]) -> Option<InputFault> {
    if !I::KNOWN {
        return None;
    }
    let fields = I::FIELDS;
    if fields.is_empty() {
        return if declared.len() > 1 { Some(InputFault::Single) } else { None };
    }
    let mut number = 0;
    while number < declared.len() {
        // A misspelt name is reported as such, and may be meant as the missing one.
        if find_input::<I>(declared[number]) == UNKNOWN_INDEX {
            return None;
        }
        number += 1;
    }
    let mut index = 0;
    while index < fields.len() {
        let field = &fields[index];
        if !field.optional && !contains(declared, field.name) {
            return Some(InputFault::Missing(field.name));
        }
        index += 1;
    }
    None
}

/// The fault of a nested estimator that cannot take its sensor as its input: the algorithm must have exactly one required
/// input, or only one.
const fn no_nested_input<I: Inputs>() -> Option<InputFault> {
    if !I::KNOWN || <I::Nested as TakenAt<I>>::INDEX != UNKNOWN_INDEX {
        return None;
    }
    let fields = I::FIELDS;
    let (mut needed, mut index) = (0, 0);
    while index < fields.len() {
        needed += if fields[index].optional { 0 } else { 1 };
        index += 1;
    }
    Some(if needed > 1 { InputFault::NeedsSeveral } else { InputFault::NeedsNone })
}

const fn describe_input(text: Text, estimator: &str, fault: InputFault) -> Text {
    let text = text.name(estimator);
    match fault {
        InputFault::Single => text.push(" takes a single input; leave out all but one"),
        InputFault::Missing(name) => {
            text.push(" needs an input ").name(name).push("; declare it: `input ").push(name).push(": …;`")
        }
        InputFault::NeedsSeveral => text
            .push(" needs several inputs, and a nested estimator has one; ")
            .push("declare it on the link, with an `input` for each"),
        InputFault::NeedsNone => text
            .push(" needs none of its several inputs, and which of them the sensor feeds cannot be told; ")
            .push("declare it on the link, with an `input` for each"),
    }
}

/// The error text for an algorithm with several outputs, none of which is declared.
const fn describe_outputs(text: Text, estimator: &str, fields: &[&str]) -> Text {
    let text = text.name(estimator).push(" has several outputs; declare the ones to publish, `output ");
    list(text.push(fields[0]).push(";`, of "), fields)
}
