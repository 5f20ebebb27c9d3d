//! The number of a declared input or output in the algorithm's struct, looked up by name at compile time.
//!
//! What is not there gets [`UNKNOWN_INDEX`], which every struct has; the check of that name reports it.

use super::text::equal;
use crate::component::{Inputs, Outputs};
use crate::stub::UNKNOWN_INDEX;

/// The field that takes the declared input `name`; a single payload takes an input of any name.
pub const fn find_input<I: Inputs>(name: &str) -> usize {
    let fields = I::FIELDS;
    let mut index = 0;
    while index < fields.len() {
        if equal(fields[index].name, name) {
            return index;
        }
        index += 1;
    }
    if fields.is_empty() && I::KNOWN { 0 } else { UNKNOWN_INDEX }
}

/// The field that takes what the parent sensor of a nested estimator publishes: the only one that the algorithm cannot
/// do without.
pub const fn find_nested<I: Inputs>() -> usize {
    let fields = I::FIELDS;
    if fields.len() == 1 {
        return 0;
    }
    let mut only = None;
    let mut index = 0;
    while index < fields.len() {
        if !fields[index].optional {
            if only.is_some() {
                return UNKNOWN_INDEX;
            }
            only = Some(index);
        }
        index += 1;
    }
    match only {
        Some(index) => index,
        None if fields.is_empty() && I::KNOWN => 0,
        None => UNKNOWN_INDEX,
    }
}

/// The field that holds the declared output `name`; `out` is a single payload.
pub const fn find_output<O: Outputs>(name: &str) -> usize {
    let fields = O::FIELDS;
    let mut index = 0;
    while index < fields.len() {
        if equal(fields[index], name) {
            return index;
        }
        index += 1;
    }
    if fields.is_empty() && O::KNOWN && equal(name, "out") { 0 } else { UNKNOWN_INDEX }
}
