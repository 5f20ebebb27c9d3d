//! An input names a publisher that is declared, by its whole path or by the end of one that no other has.
//!
//! Right: `input imu: sensor::base::imu;` or `input imu: imu;` where `base` has the only sensor `imu`
//! Wrong: `input imu: sensor::base::inu;`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::names::nearest;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // Inputs of nested estimators are a fault of their own; unread items may have declared the missing ones.
    let estimators = robot.estimators.iter().filter(|estimator| !estimator.is_nested() && robot.complete);
    for input in estimators.flat_map(|estimator| &estimator.inputs).filter(|input| input.source.is_none()) {
        let path = input.path.text();
        if !input.candidates.is_empty() {
            let candidates = input.candidates.iter().filter_map(|id| robot.publishers.get(*id));
            let paths: Vec<String> =
                candidates.take(8).map(|publisher| format!("`{}`", publisher.path.join("::"))).collect();
            let message = format!("`{path}` may be {}; write more of the path", paths.join(" or "));
            diagnostics.at(input.path.place(), message);
            continue;
        }
        let known: Vec<String> = robot.publishers.iter().map(|publisher| publisher.path.join("::")).collect();
        let message = match nearest(&path, known.iter().map(String::as_str)) {
            Some(near) => format!("nothing publishes at `{path}`; did you mean `{near}`?"),
            None if known.is_empty() => format!("nothing publishes at `{path}`; this robot has no sensor"),
            None => {
                let shown: Vec<String> = known.iter().take(8).map(|path| format!("`{path}`")).collect();
                let more = if known.len() > shown.len() { ", …" } else { "" };
                format!("nothing publishes at `{path}`; there are {}{more}", shown.join(", "))
            }
        };
        diagnostics.at(input.path.place(), message);
    }
}
