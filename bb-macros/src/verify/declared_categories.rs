//! `category` and `cancel` name declared categories, or `default`; none is called `all`.
//!
//! Right: `commands { category motion; go: Go { category: motion; } halt: Halt { cancel: [motion]; } }`
//! Wrong: `halt: Halt { cancel: [motoin]; }`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::names::{text, way_out};
use crate::parse::Cancelled;
use proc_macro2::Ident;
use std::collections::HashSet;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for name in robot.categories.iter().map(|category| &category.name).filter(|name| *name == "all") {
        let message = "`all` means all categories, as in `cancel: all;`; choose another name";
        diagnostics.error(name, message.into());
    }
    for settings in robot.commands.iter().map(|command| &command.settings) {
        for category in &settings.categories {
            declared(robot, &category.name, diagnostics);
        }
        for cancel in &settings.cancels {
            let Cancelled::Categories(names) = &cancel.cancelled else { continue };
            let mut seen = HashSet::new();
            for name in names {
                if declared(robot, name, diagnostics) && !seen.insert(name.to_string()) {
                    diagnostics.error(name, format!("`{name}` is given twice; leave one out"));
                }
            }
        }
    }
}

/// Returns whether there is such a category; if not, reports it.
fn declared(robot: &Robot, name: &Ident, diagnostics: &mut Diagnostics) -> bool {
    // Unread items may have declared the missing ones.
    if robot.category(name).is_some() || !robot.complete {
        return true;
    }
    let message = if robot.command(name).is_some() {
        format!("`{name}` is a command, not a category; give it a `category` and name that")
    } else if name == "all" {
        "`all` is not a category; to end all commands write `cancel: all;`".into()
    } else {
        let known: Vec<String> = robot.categories.iter().map(|category| text(&category.name)).collect();
        let way_out = way_out(&text(name), known.iter().map(String::as_str), "commands");
        format!("there is no category `{name}`; {way_out}")
    };
    diagnostics.error(name, message);
    false
}
