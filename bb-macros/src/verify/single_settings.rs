//! A setting is written once in its block, and an option once in its parentheses.
//!
//! Wrong: `sensor imu: A() { rate: 100 Hz; rate: 200 Hz; }`
//!
//! The table of the language says which words may be repeated.

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use proc_macro2::Ident;
use std::collections::HashSet;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for word in &robot.repeated {
        diagnostics.error(word, twice(word));
    }
    for component in robot.components() {
        let mut given = HashSet::new();
        for name in component.options.iter().map(|option| &option.name) {
            if !given.insert(name.to_string()) {
                diagnostics.error(name, twice(name));
            }
        }
    }
}

fn twice(word: &Ident) -> String {
    format!("`{word}` is given twice; leave one out")
}
