//! No two publishers have the same path, or the path of another part of the robot; no two inputs of an estimator have
//! the same name.
//!
//! Right: `output pose; output velocity: [nav, velocity];`
//! Wrong: `output pose; output velocity: [estimator, base, fused, pose];`

use crate::diagnostics::{Diagnostics, Place};
use crate::model::{EstimatorId, From, Publisher, Robot};
use crate::parse::Output;
use proc_macro2::Ident;
use std::collections::HashMap;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let mut taken: HashMap<&[String], &Publisher> = HashMap::new();
    for publisher in &robot.publishers {
        let Some(first) = taken.insert(&publisher.path, publisher) else {
            continue;
        };
        // If one of the two has this path because of its output's path, that path is the one to change. Two that have
        // it by their names are outputs of one estimator, or siblings with one name, which are reported as such.
        match (explicit(robot, publisher).or(explicit(robot, first)), output(robot, publisher)) {
            (Some(place), _) => {
                let path = publisher.path.join("::");
                diagnostics.at(place, format!("something else publishes at `{path}`; choose another path"));
            }
            (None, Some(output)) if estimator(publisher) == estimator(first) => {
                let message = format!("an output `{}` is already declared; leave one out", output.name);
                diagnostics.error(&output.name, message);
            }
            (None, _) => {}
        }
    }
    // An estimator has a handle at its own path, even if it publishes only below that path.
    for publisher in &robot.publishers {
        let own = robot.estimators.enumerate().find(|(_, estimator)| estimator.path == publisher.path);
        if let (Some((id, own)), Some(place)) = (own, explicit(robot, publisher))
            && estimator(publisher) != Some(id)
            && !own.outputs.is_empty()
        {
            let message = format!("the estimator `{}` already has this path; choose another path", own.name);
            diagnostics.at(place, message);
        }
    }
    let others = others(robot);
    for publisher in &robot.publishers {
        if let (Some(place), Some(other)) = (explicit(robot, publisher), others.get(&publisher.path[..])) {
            diagnostics.at(place, format!("{other} has this path already; choose another path"));
        }
    }
    for estimator in robot.estimators.iter().filter(|estimator| !estimator.is_nested()) {
        let mut names: HashMap<String, &Ident> = HashMap::new();
        for input in &estimator.inputs {
            if names.insert(input.name.to_string(), &input.name).is_some() {
                let message =
                    format!("`{}` already has an input `{}`; choose another name", estimator.name, input.name);
                diagnostics.error(&input.name, message);
            }
        }
    }
}

/// Paths of parts that are not declared publishers, with their names in messages.
fn others(robot: &Robot) -> HashMap<&[String], String> {
    let actuators = robot.actuators.iter().map(|it| (&it.path[..], format!("the actuator `{}`", it.name)));
    let parameters = robot.parameters.iter().map(|it| (&it.path[..], format!("the parameter `{}`", it.name)));
    let groups = robot.parameter_groups.iter().map(|it| (&it.path[..], format!("the group `{}`", it.name)));
    let commands = robot.commands.iter().map(|it| (&it.path[..], format!("the command `{}`", it.name)));
    actuators.chain(parameters).chain(groups).chain(commands).collect()
}

/// The declared output of a publisher.
fn output<'a>(robot: &'a Robot, publisher: &Publisher) -> Option<&'a Output> {
    let From::Estimator(estimator, Some(output)) = publisher.from else {
        return None;
    };
    robot.estimators[estimator].outputs.get(output)
}

/// The place where a publisher's path is written out, if it is.
fn explicit(robot: &Robot, publisher: &Publisher) -> Option<Place> {
    let path = output(robot, publisher)?.path.as_ref()?;
    Some(Place { start: path.first()?.span(), end: path.last()?.span() })
}

fn estimator(publisher: &Publisher) -> Option<EstimatorId> {
    match publisher.from {
        From::Estimator(estimator, _) => Some(estimator),
        From::Sensor(_) | From::Service(_) => None,
    }
}
