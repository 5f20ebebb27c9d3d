//! The number of a declared input or output in the algorithm's struct, looked up by name at compile time.
//!
//! An unknown name gets [`UNKNOWN_INDEX`], which every struct has; the check of that name reports it.

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
