//! No two publishers have one path, and no two inputs of an estimator one name.
//!
//! Right: `output pose; output velocity: [nav, velocity];`
//! Wrong: `output pose; output velocity: [estimator, base, fused, pose];`

use crate::diagnostics::Diagnostics;
use crate::model::{From, Publisher, Robot};
use proc_macro2::Ident;
use std::collections::HashMap;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let mut taken: HashMap<&[String], &Publisher> = HashMap::new();
    for publisher in &robot.publishers {
        let Some(first) = taken.insert(&publisher.path, publisher) else {
            continue;
        };
        // Siblings of one name are reported as such.
        if let (Some(name), true) =
            (output(robot, publisher), output(robot, first).is_some() || explicit(robot, publisher))
        {
            let path = publisher.path.join("::");
            diagnostics.error(name, format!("something publishes at `{path}` already; choose another path"));
        }
    }
    for estimator in robot.estimators.iter().filter(|estimator| !estimator.is_nested()) {
        let mut names: HashMap<String, &Ident> = HashMap::new();
        for input in &estimator.inputs {
            if names.insert(input.name.to_string(), &input.name).is_some() {
                let message =
                    format!("`{}` has an input `{}` already; choose another name", estimator.name, input.name);
                diagnostics.error(&input.name, message);
            }
        }
    }
}

/// The name of the declared output behind a publisher.
fn output<'a>(robot: &'a Robot, publisher: &Publisher) -> Option<&'a Ident> {
    let From::Estimator(estimator, Some(output)) = publisher.from else {
        return None;
    };
    Some(&robot.estimators.get(estimator)?.outputs.get(output)?.name)
}

fn explicit(robot: &Robot, publisher: &Publisher) -> bool {
    let From::Estimator(estimator, Some(output)) = publisher.from else {
        return false;
    };
    robot
        .estimators
        .get(estimator)
        .and_then(|estimator| estimator.outputs.get(output))
        .is_some_and(|output| output.path.is_some())
}
