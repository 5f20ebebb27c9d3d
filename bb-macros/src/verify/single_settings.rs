//! A setting that holds for a whole block stands in it once, and an option in its parentheses.
//!
//! Wrong: `sensor imu: A() { rate: 100 Hz; rate: 200 Hz; }`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::parse::{CommandSettings, HealthSettings};
use proc_macro2::Ident;
use std::collections::HashSet;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for sensor in &robot.sensors {
        once(sensor.rates.iter().map(|rate| &rate.word), diagnostics);
    }
    for service in &robot.services {
        once(service.rates.iter().map(|rate| &rate.word), diagnostics);
    }
    for category in &robot.categories {
        once(category.concurrencies.iter().map(|concurrency| &concurrency.word), diagnostics);
    }
    for CommandSettings { allowed_states, timeouts, categories, cancels } in
        robot.commands.iter().map(|command| &command.settings)
    {
        once(allowed_states.iter().map(|allowed| &allowed.word), diagnostics);
        once(timeouts.iter().map(|timeout| &timeout.word), diagnostics);
        once(categories.iter().map(|category| &category.word), diagnostics);
        once(cancels.iter().map(|cancel| &cancel.word), diagnostics);
    }
    for component in robot.components() {
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
    for estimator in &robot.estimators {
        let HealthSettings { latency_budgets, lost_afters, recover_afters, .. } = &estimator.health.settings;
        for settings in [latency_budgets, lost_afters, recover_afters] {
            once(settings.iter().map(|setting| &setting.word), diagnostics);
        }
        let HealthSettings { on_degraded, on_lost, on_recovered, .. } = &estimator.health.settings;
        for reactions in [on_degraded, on_lost, on_recovered] {
            once(reactions.iter().map(|reaction| &reaction.word), diagnostics);
        }
        once(estimator.runs_on.iter().map(|runs_on| &runs_on.word), diagnostics);
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
