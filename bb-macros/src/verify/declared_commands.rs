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
    let declared: Vec<String> = robot.commands.iter().map(|command| text(&command.name)).collect();
    for reaction in robot.estimators.iter().flat_map(|estimator| estimator.reactions.all()) {
        let name = &reaction.command;
        if robot.command(name).is_some() {
            continue;
        }
        let way_out = way_out(&text(name), declared.iter().map(String::as_str), "commands");
        diagnostics.error(name, format!("there is no command `{name}`; {way_out}"));
    }
}
