//! An option that starts with `param::` names a parameter that is declared, by its whole path.
//!
//! Right: `Madgwick(beta = param::imu::beta)` where `parameters` has `imu { beta: f64 = 0.1; }`
//! Wrong: `Madgwick(beta = param::imu::gain)`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::names::{declare, nearest_path, some_of};
use crate::parse::OptionValue;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // Unread items may have declared the missing ones.
    if !robot.complete {
        return;
    }
    let known: Vec<String> = robot.parameters.iter().map(|parameter| parameter.path.join("::")).collect();
    for option in robot.components().flat_map(|component| &component.options) {
        let OptionValue::Parameter(path) = &option.value else { continue };
        if robot.parameter(path).is_some() {
            continue;
        }
        let text = path.text();
        let inside: Vec<&str> = known
            .iter()
            .map(String::as_str)
            .filter(|known| known.strip_prefix(&text).is_some_and(|rest| rest.starts_with("::")))
            .collect();
        let message = if !inside.is_empty() {
            format!("`{text}` is a group of parameters; name one in it: {}", some_of(&inside))
        } else if let Some(near) = nearest_path(&text, &known) {
            format!("there is no parameter `{text}`; did you mean `{near}`?")
        } else {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            format!("there is no parameter `{text}`; {}", declare(&known, "parameters"))
        };
        diagnostics.at(path.place(), message);
    }
}
