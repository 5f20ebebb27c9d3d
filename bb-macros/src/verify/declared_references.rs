//! An option that is a path names something that the robot declares, by its whole path; and a field only of a publisher's messages.
//!
//! Right: `Reaction(when = sensor::battery.voltage, below = 11 V, run = command::land)`
//! Wrong: `Reaction(when = sensor::batery.voltage, below = 11 V, run = command::lnad)`

use super::declared_commands::no_command;
use super::declared_publishers::{nothing_at, undeclared_output};
use crate::diagnostics::Diagnostics;
use crate::model::{Robot, Target};
use crate::names::{nearest_path, some_of, text};
use crate::parse::{OptionValue, Reference};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // Unread items may have declared the missing ones.
    if !robot.complete {
        return;
    }
    for option in robot.components().flat_map(|component| &component.options) {
        let OptionValue::Reference(reference) = &option.value else { continue };
        match robot.target(&reference.path) {
            None => diagnostics.at(reference.path.place(), unknown(robot, reference)),
            Some(Target::Publisher(_)) => {}
            Some(Target::Command(_) | Target::Actuator(_)) => {
                if let Some(place) = reference.field_place() {
                    let message = format!(
                        "only fields of what sensors, estimators, controllers and bridges publish can be named; leave `.{}` out",
                        reference.field()
                    );
                    diagnostics.at(place, message);
                }
            }
        }
    }
}

/// The message for a path at which nothing is declared.
fn unknown(robot: &Robot, reference: &Reference) -> String {
    let path = reference.path.text();
    match reference.path.0.first().map(text).as_deref() {
        Some("command") => no_command(robot, path.trim_start_matches("command::")),
        Some("actuator") => {
            let known: Vec<String> = robot.actuators.iter().map(|actuator| actuator.path.join("::")).collect();
            match nearest_path(&path, &known) {
                Some(near) => format!("there is no actuator `{path}`; did you mean `{near}`?"),
                None if known.is_empty() => format!("there is no actuator `{path}`; declare it in a joint"),
                None => {
                    let known: Vec<&str> = known.iter().map(String::as_str).collect();
                    format!("there is no actuator `{path}`; declared are {}", some_of(&known))
                }
            }
        }
        _ => undeclared_output(robot, &reference.path).unwrap_or_else(|| {
            let known: Vec<String> = robot.publishers.iter().map(|publisher| publisher.path.join("::")).collect();
            nothing_at(&path, &known)
        }),
    }
}
