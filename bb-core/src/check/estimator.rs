//! Whether an estimator's declaration is complete.

use super::find::find_input;
use super::names::list;
use super::options::missing_option;
use super::text::{Text, equal};
use crate::component::{Estimator, Inputs, OptionField, Options, Outputs, TakenAt};
use crate::stub::UNKNOWN_INDEX;

/// Checks that an estimator has its required options among `given`, its required inputs among `declared`, and an output if it
/// has several. `declared` is `None` for a nested estimator, whose one input is its sensor's.
///
/// Everything that is missing is one message, since it is reported at one word.
#[track_caller]
pub const fn check_estimator<E: Estimator>(
    estimator: &str,
    given: &[&str],
    declared: Option<&[&str]>,
    has_outputs: bool,
) {
    let fields: &[OptionField] = <E::Options as Options>::FIELDS;
    let mut fault = missing_option(estimator, fields, given);
    fault = and(
        fault,
        match declared {
            Some(declared) => missing_input::<E::Input>(estimator, declared),
            None => no_nested_input::<E::Input>(estimator),
        },
    );
    if !has_outputs {
        fault = and(fault, no_output::<E::Output>(estimator));
    }
    if let Some(text) = fault {
        panic!("{}", text.as_str())
    }
}

const fn and(first: Option<Text>, second: Option<Text>) -> Option<Text> {
    match (first, second) {
        (Some(first), Some(second)) => Some(first.push("; and ").push(second.as_str())),
        (Some(fault), None) | (None, Some(fault)) => Some(fault),
        (None, None) => None,
    }
}

/// The first required input that is not declared.
const fn missing_input<I: Inputs>(estimator: &str, declared: &[&str]) -> Option<Text> {
    if !I::KNOWN {
        return None;
    }
    let fields = I::FIELDS;
    let mut misspelt = false;
    let mut number = 0;
    while number < declared.len() {
        misspelt = misspelt || find_input::<I>(declared[number]) == UNKNOWN_INDEX;
        number += 1;
    }
    if fields.is_empty() && declared.len() > 1 {
        return Some(Text::new("").name(estimator).push(" takes a single input; leave out all but one"));
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
        // A misspelt name is reported as such, and may be meant to be this one.
        if !found && !misspelt {
            let text = Text::new("").name(estimator).push(" needs an input ").name(field.name);
            return Some(text.push("; declare it: `input ").push(field.name).push(": …;`"));
        }
        index += 1;
    }
    None
}

/// Why the sensor of a nested estimator is not its input: the algorithm must have exactly one required input, or only one.
const fn no_nested_input<I: Inputs>(estimator: &str) -> Option<Text> {
    if !I::KNOWN || <I::Nested as TakenAt<I>>::INDEX != UNKNOWN_INDEX {
        return None;
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
    Some(text.push("declare it on the link, with an `input` for each"))
}

/// Reports that an algorithm of several outputs has none declared.
const fn no_output<O: Outputs>(estimator: &str) -> Option<Text> {
    let fields = O::FIELDS;
    if fields.is_empty() {
        return None;
    }
    let text = Text::new("").name(estimator).push(" has several outputs; declare the ones to publish, `output ");
    Some(list(text.push(fields[0]).push(";`, of "), fields))
}
