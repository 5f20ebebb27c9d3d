//! A setting that holds for a whole block stands in it once, and an option in its parentheses.
//!
//! Wrong: `sensor imu: A() { rate: 100 Hz; rate: 200 Hz; }`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use proc_macro2::Ident;
use std::collections::HashSet;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for sensor in &robot.sensors {
        once(sensor.rates.iter().map(|rate| &rate.word), diagnostics);
    }
    let sensors = robot.sensors.iter().map(|sensor| &sensor.component);
    for component in sensors.chain(robot.estimators.iter().map(|estimator| &estimator.component)) {
        let mut given = HashSet::new();
        for name in component.options.iter().map(|option| &option.name) {
            if !given.insert(name.to_string()) {
                diagnostics.error(name, twice(name));
            }
        }
    }
    for link in &robot.links {
        once(link.inertials.iter().map(|inertial| &inertial.word), diagnostics);
    }
    for joint in &robot.joints {
        once(joint.origins.iter().map(|origin| &origin.word), diagnostics);
        once(joint.axes.iter().map(|axis| &axis.word), diagnostics);
        once(joint.limits.iter().map(|limit| &limit.word), diagnostics);
        once(joint.dynamics.iter().map(|dynamics| &dynamics.word), diagnostics);
        once(joint.mimics.iter().map(|mimic| &mimic.word), diagnostics);
        once(joint.transmissions.iter().map(|transmission| &transmission.word), diagnostics);
    }
    for estimator in robot.estimators.iter().filter(|estimator| !estimator.is_nested()) {
        once(estimator.sync_tolerances.iter().map(|tolerance| &tolerance.word), diagnostics);
    }
}

fn once<'a>(words: impl Iterator<Item = &'a Ident>, diagnostics: &mut Diagnostics) {
    for extra in words.skip(1) {
        diagnostics.error(extra, twice(extra));
    }
}

fn twice(word: &Ident) -> String {
    format!("`{word}` stands here twice; leave one out")
}
