//! An input names a declared publisher, by its whole path or by a suffix that no other has.
//!
//! Right: `input imu: sensor::base::imu;` or `input imu: imu;` where `base` has the only sensor `imu`
//! Wrong: `input imu: sensor::base::inu;`
//!
//! An external input has a path of which the robot declares and publishes nothing.
//!
//! Right: `input pose: slam::pose, external;`
//! Wrong: `input imu: sensor::base::imu, external;`

use crate::diagnostics::Diagnostics;
use crate::model::{From, PublisherId, Robot};
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
        let message = nothing_at(&path, &known);
        let hint = if may_be_external(&input.path, &known) {
            "; if other code publishes there, add `, external`"
        } else {
            ""
        };
        diagnostics.at(input.path.place(), message + hint);
    }
    external(robot, diagnostics);
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

/// Returns whether a path is like none of the robot's: of several names, and not below what it declares. Of a robot
/// that declares no publisher, a path that begins as its own do is meant for one of those.
fn may_be_external(path: &Path, known: &[String]) -> bool {
    let Some((root, [_, ..])) = path.0.split_first() else { return false };
    let root = text(root);
    nearest_path(&path.text(), known).is_none()
        && !(known.is_empty() && ["sensor", "estimator", "controller", "bridge"].contains(&&*root))
        && !known.iter().any(|known| known.split("::").next() == Some(&*root))
}

/// The paths at which every robot publishes.
const SYSTEM: [&str; 6] = ["fault", "health", "journal", "safety", "safety::error", "state_machine"];

fn external(robot: &Robot, diagnostics: &mut Diagnostics) {
    let estimators = robot.estimators.iter().filter(|estimator| !estimator.is_nested());
    for input in estimators.flat_map(|estimator| &estimator.inputs) {
        let (Some(word), path) = (&input.external, input.path.text()) else { continue };
        let is_declared = input.source.is_some_and(|source| !is_external(robot, source));
        let names: Vec<String> = input.path.0.iter().map(text).collect();
        let actuator = robot.actuators.iter().find(|actuator| names.starts_with(&actuator.path));
        let mut others = robot.parameters.iter().map(|it| &it.path).chain(robot.commands.iter().map(|it| &it.path));
        let is_other = others.any(|path| *path == names) || robot.estimators.iter().any(|it| it.path == names);
        if is_declared {
            diagnostics.error(word, format!("`{path}` is a publisher of the robot; leave out `external`"));
        } else if let Some(actuator) = actuator {
            let message = format!("the actuator `{}` publishes at `{path}`, not other code", actuator.name);
            diagnostics.at(input.path.place(), message);
        } else if is_other || SYSTEM.contains(&&*path) {
            let message = format!("the robot itself publishes at `{path}`; choose another path");
            diagnostics.at(input.path.place(), message);
        }
    }
}

fn is_external(robot: &Robot, publisher: PublisherId) -> bool {
    matches!(robot.publishers[publisher].from, From::Sensor(id) if robot.sensors[id].external.is_some())
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
