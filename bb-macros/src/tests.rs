//! Level one: diagnostics as data. Each is a pair of the text that it points at and its message.

mod commands;
mod expansion;
mod health;
mod mistakes;
mod model;
mod mutations;
mod notation;
mod parameters;
mod recovery;
mod reference;
mod rules;

use crate::diagnostics::{Diagnostic, Diagnostics};
use crate::{parse, verify};
use proc_macro2::TokenStream;

/// Tokens with places in `text`.
fn tokens(text: &str) -> TokenStream {
    text.parse().unwrap_or_else(|error| panic!("`{text}` are no tokens: {error}"))
}

/// All errors of a robot.
fn diagnostics(tokens: TokenStream) -> Vec<Diagnostic> {
    let mut diagnostics = Diagnostics::default();
    let tree = parse::robot(tokens, &mut diagnostics);
    let robot = crate::model::resolve(tree);
    verify::verify(&robot, &mut diagnostics);
    diagnostics.all().to_vec()
}

/// The errors of a robot, each with the text under it.
fn faults(robot: &str) -> Vec<(String, String)> {
    let faults = diagnostics(tokens(robot)).into_iter().map(|Diagnostic { place, message }| {
        let under = place.start.byte_range().start..place.end.byte_range().end;
        (robot.get(under).unwrap_or("").to_owned(), message)
    });
    faults.collect()
}

/// The texts under the errors of a robot.
fn places(robot: &str) -> Vec<String> {
    faults(robot).into_iter().map(|(place, _)| place).collect()
}

/// Asserts that a robot has these faults and no others.
#[track_caller]
fn wrong(robot: &str, expected: &[(&str, &str)]) {
    let found = faults(robot);
    let found: Vec<(&str, &str)> = found.iter().map(|(place, message)| (&**place, &**message)).collect();
    assert_eq!(found, expected, "in {robot}");
}

/// Asserts that nothing is wrong with a robot.
#[track_caller]
fn right(robot: &str) {
    wrong(robot, &[]);
}

/// A robot whose root link holds `content`.
fn base(content: &str) -> String {
    format!("robot Rover; link base {{ {content} }}")
}

/// A robot with two sensors and `content` in its root link.
fn sensing(content: &str) -> String {
    base(&format!("sensor imu: A(); sensor mag: B(); {content}"))
}
