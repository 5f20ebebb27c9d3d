//! `on_degraded`, `on_lost` and `on_recovered` name declared commands.
//!
//! Right: `on_lost: stop;` where `commands` has `stop: Stop;`
//! Wrong: `on_lost: sotp;`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::names::{text, way_out};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // Unread items may have declared the missing ones.
    if !robot.complete {
        return;
    }
    for reaction in robot.estimators.iter().flat_map(|estimator| estimator.reactions.all()) {
        let name = &reaction.command;
        if robot.command(name).is_some() {
            continue;
        }
        diagnostics.error(name, no_command(robot, &text(name)));
    }
}

/// The message for a command that is not declared.
pub(super) fn no_command(robot: &Robot, name: &str) -> String {
    let declared: Vec<String> = robot.commands.iter().map(|command| text(&command.name)).collect();
    let way_out = way_out(name, declared.iter().map(String::as_str), "commands");
    format!("there is no command `{name}`; {way_out}")
}
