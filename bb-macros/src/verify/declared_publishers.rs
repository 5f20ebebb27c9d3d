//! An input names a declared publisher, by its whole path or by a suffix that no other has.
//!
//! Right: `input imu: sensor::base::imu;` or `input imu: imu;` where `base` has the only sensor `imu`
//! Wrong: `input imu: sensor::base::inu;`

use crate::diagnostics::Diagnostics;
use crate::model::{From, Robot};
use crate::names::{nearest, nearest_path, some_of, text};
use crate::parse::Path;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // Inputs of nested estimators are reported by another rule; unread items may have declared the missing ones.
    let estimators = robot.estimators.enumerate();
    let estimators = estimators.filter(|(_, estimator)| !estimator.is_nested() && robot.complete);
    let inputs = estimators.flat_map(|(id, estimator)| estimator.inputs.iter().map(move |input| (id, input)));
    for (id, input) in inputs.filter(|(_, input)| input.source.is_none()) {
        let path = input.path.text();
        if !input.candidates.is_empty() {
            let candidates = input.candidates.iter().map(|id| &robot.publishers[*id]);
            let paths: Vec<String> =
                candidates.take(8).map(|publisher| format!("`{}`", publisher.path.join("::"))).collect();
            let message = format!("`{path}` may be {}; write more of the path", paths.join(" or "));
            diagnostics.at(input.path.place(), message);
            continue;
        }
        if let Some(message) = undeclared_output(robot, &input.path) {
            diagnostics.at(input.path.place(), message);
            continue;
        }
        // The estimator's own paths would close a cycle.
        let is_other = |from| !matches!(from, From::Estimator(own, _) if own == id);
        let others = robot.publishers.iter().filter(|publisher| is_other(publisher.from));
        let known: Vec<String> = others.map(|publisher| publisher.path.join("::")).collect();
        diagnostics.at(input.path.place(), nothing_at(&path, &known));
    }
}

/// The message for a path without a publisher.
pub(super) fn nothing_at(path: &str, known: &[String]) -> String {
    match nearest_path(path, known) {
        Some(near) => format!("nothing publishes at `{path}`; did you mean `{near}`?"),
        None if known.is_empty() => format!("nothing publishes at `{path}`, nor elsewhere; declare a sensor"),
        None => {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            format!("nothing publishes at `{path}`; declared are {}", some_of(&known))
        }
    }
}

/// The message for a path below an estimator: the output may be undeclared or misspelt, which only its type can tell.
pub(super) fn undeclared_output(robot: &Robot, path: &Path) -> Option<String> {
    let (output, above) = path.0.split_last()?;
    let above: Vec<String> = above.iter().map(text).collect();
    let is_below = |path: &[String]| !above.is_empty() && path.ends_with(&above);
    let mut below = robot.estimators.iter().filter(|estimator| is_below(&estimator.path));
    let (Some(estimator), None) = (below.next(), below.next()) else { return None };
    let (estimator_name, output) = (text(&estimator.name), text(output));
    let start = format!("`{estimator_name}` declares no output `{output}`");
    let declared: Vec<String> = estimator.outputs.iter().map(|output| text(&output.name)).collect();
    let way_out = match nearest(&output, declared.iter().map(String::as_str)) {
        Some(near) => format!("it declares `{near}`; give it the algorithm's name in both places"),
        None => format!("if the algorithm has it, add `output {output};` there"),
    };
    Some(format!("{start}; {way_out}"))
}
