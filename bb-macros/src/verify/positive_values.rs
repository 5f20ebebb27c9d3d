//! Rates, times and the limits of speed and effort are positive, and what is counted is a whole number in its range. (A
//! URDF's limits of speed and effort may be 0.)
//!
//! Right: `rate: 200 Hz;`
//! Wrong: `rate: 0 Hz;`

use super::dimensions::of_limit;
use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::parse::{HealthSettings, JointKind, Quantity, RunsOn};
use crate::units::Dimension;

/// Beyond it a period is less than a nanosecond.
const HIGHEST_RATE_HZ: f64 = 1e9;
/// 292 years: beyond it nanoseconds do not fit.
const LONGEST_TIME_S: f64 = 9.2e9;

/// Of Linux's real-time classes.
const HIGHEST_PRIORITY: u32 = 99;
/// Linux knows no more cores.
const HIGHEST_CORE: u32 = 8191;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for rate in robot.rates() {
        let rate = &rate.quantity;
        positive(rate, Dimension::FREQUENCY, HIGHEST_RATE_HZ, "1 GHz", diagnostics);
        if rate.dimension == Dimension::FREQUENCY && rate.value > 0.0 && 1.0 / rate.value > LONGEST_TIME_S {
            diagnostics.at(rate.place, "this rate is too low; it must be more than once in 292 years".into());
        }
    }
    for estimator in &robot.estimators {
        let tolerances = estimator.sync_tolerances.iter().map(|tolerance| &tolerance.quantity);
        for time in tolerances.chain(estimator.inputs.iter().filter_map(|input| input.within.as_ref())) {
            positive(time, Dimension::TIME, LONGEST_TIME_S, "292 years", diagnostics);
        }
        let HealthSettings { latency_budgets, lost_afters, recover_afters, .. } = &estimator.health.settings;
        for time in latency_budgets.iter().chain(lost_afters) {
            positive(&time.quantity, Dimension::TIME, LONGEST_TIME_S, "292 years", diagnostics);
        }
        for count in recover_afters {
            whole(&count.quantity, 1, u32::MAX, diagnostics);
        }
        for RunsOn { priority, core, .. } in &estimator.runs_on {
            priority.iter().for_each(|priority| whole(priority, 1, HIGHEST_PRIORITY, diagnostics));
            core.iter().for_each(|core| whole(core, 0, HIGHEST_CORE, diagnostics));
        }
    }
    for timeout in robot.commands.iter().flat_map(|command| &command.settings.timeouts) {
        positive(&timeout.quantity, Dimension::TIME, LONGEST_TIME_S, "292 years", diagnostics);
    }
    for concurrency in robot.categories.iter().flat_map(|category| &category.concurrencies) {
        whole(&concurrency.quantity, 1, u32::MAX, diagnostics);
    }
    // A fixed joint's limit is a fault of its own.
    for joint in robot.joints.iter().filter(|joint| joint.kind != JointKind::Fixed && !joint.from_urdf) {
        let [_, (velocity, _), (effort, _)] = of_limit(joint.kind);
        for limit in &joint.limits {
            for (quantity, dimension) in [(&limit.velocity, velocity), (&limit.effort, effort)] {
                if let Some(quantity) = quantity {
                    positive(quantity, dimension, f64::MAX, "", diagnostics);
                }
            }
        }
    }
}

/// A plain number without a fraction.
fn whole(quantity: &Quantity, lowest: u32, highest: u32, diagnostics: &mut Diagnostics) {
    // A unit is a fault of its own.
    if quantity.has_unit {
        return;
    }
    if quantity.value.fract() != 0.0 {
        diagnostics.at(quantity.place, "this must be a whole number".into());
    } else if quantity.value < f64::from(lowest) {
        diagnostics.at(quantity.place, format!("this must be at least {lowest}"));
    } else if quantity.value > f64::from(highest) {
        diagnostics.at(quantity.place, format!("this must be at most {highest}"));
    }
}

/// A quantity of another dimension is a fault of its own.
fn positive(
    quantity: &Quantity,
    dimension: Dimension,
    highest: f64,
    highest_text: &str,
    diagnostics: &mut Diagnostics,
) {
    if quantity.dimension != dimension {
        return;
    }
    if quantity.value <= 0.0 {
        diagnostics.at(quantity.place, "this must be more than 0".into());
    } else if quantity.value > highest {
        diagnostics.at(quantity.place, format!("this must be at most {highest_text}"));
    }
}
