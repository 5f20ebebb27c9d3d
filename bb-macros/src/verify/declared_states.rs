//! `allowed_states` names built-in or declared states, each once; a declared state is not built in.
//!
//! Right: `states { degraded; }` and `allowed_states: [idle, degraded];`
//! Wrong: `allowed_states: [idle, degarded];`

use crate::diagnostics::Diagnostics;
use crate::model::{BUILT_IN_STATES, Robot};
use crate::names::{text, way_out};
use std::collections::HashSet;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for name in robot.states.iter().map(|state| &state.name) {
        if BUILT_IN_STATES.contains(&&*text(name)) {
            diagnostics.error(name, format!("every robot has the state `{name}`; leave it out"));
        }
    }
    let declared: Vec<String> = robot.states.iter().map(|state| text(&state.name)).collect();
    let known = || BUILT_IN_STATES.into_iter().chain(declared.iter().map(String::as_str));
    for allowed in robot.commands.iter().flat_map(|command| &command.settings.allowed_states) {
        let mut seen = HashSet::new();
        for state in &allowed.states {
            let name = text(state);
            // Unread items may have declared the missing ones.
            if robot.complete && known().all(|known| known != name) {
                let way_out = way_out(&name, known(), "states");
                diagnostics.error(state, format!("there is no state `{name}`; {way_out}"));
            } else if !seen.insert(name) {
                diagnostics.error(state, format!("`{state}` is given twice; leave one out"));
            }
        }
    }
}
