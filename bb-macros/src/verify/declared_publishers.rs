//! An input names a publisher that is declared, by its whole path or by the end of one that no other has.
//!
//! Right: `input imu: sensor::base::imu;` or `input imu: imu;` where `base` has the only sensor `imu`
//! Wrong: `input imu: sensor::base::inu;`

use crate::diagnostics::Diagnostics;
use crate::model::{From, Robot};
use crate::names::nearest;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // Inputs of nested estimators are a fault of their own; unread items may have declared the missing ones.
    let estimators = robot.estimators.iter().enumerate();
    let estimators = estimators.filter(|(_, estimator)| !estimator.is_nested() && robot.complete);
    let inputs = estimators.flat_map(|(id, estimator)| estimator.inputs.iter().map(move |input| (id, input)));
    for (id, input) in inputs.filter(|(_, input)| input.source.is_none()) {
        let path = input.path.text();
        if !input.candidates.is_empty() {
            let candidates = input.candidates.iter().filter_map(|id| robot.publishers.get(*id));
            let paths: Vec<String> =
                candidates.take(8).map(|publisher| format!("`{}`", publisher.path.join("::"))).collect();
            let message = format!("`{path}` may be {}; write more of the path", paths.join(" or "));
            diagnostics.at(input.path.place(), message);
            continue;
        }
        // The estimator's own paths would close a cycle.
        let is_other = |from| !matches!(from, From::Estimator(own, _) if own == id);
        let others = robot.publishers.iter().filter(|publisher| is_other(publisher.from));
        let known: Vec<String> = others.map(|publisher| publisher.path.join("::")).collect();
        let message = match nearest_path(&path, &known) {
            Some(near) => format!("nothing publishes at `{path}`; did you mean `{near}`?"),
            None if known.is_empty() => format!("nothing publishes at `{path}`, nor elsewhere; declare a sensor"),
            None => {
                let shown: Vec<String> = known.iter().take(8).map(|path| format!("`{path}`")).collect();
                let more = if known.len() > shown.len() { ", …" } else { "" };
                format!("nothing publishes at `{path}`; declared are {}{more}", shown.join(", "))
            }
        };
        diagnostics.at(input.path.place(), message);
    }
}

/// The path whose names are all near to those of `path`; else one with the same last name.
fn nearest_path<'a>(path: &str, known: &'a [String]) -> Option<&'a str> {
    let names: Vec<&str> = path.split("::").collect();
    let known = || known.iter().map(String::as_str);
    let is_near = |candidate: &&str| {
        let candidate: Vec<&str> = candidate.split("::").collect();
        let mut pairs = names.iter().zip(&candidate);
        names.len() == candidate.len()
            && pairs.all(|(name, other)| name == other || nearest(name, [*other]).is_some())
    };
    let near = nearest(path, known().filter(is_near));
    near.or_else(|| known().find(|candidate| candidate.rsplit("::").next() == names.last().copied()))
}
