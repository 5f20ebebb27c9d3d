//! Rates, tolerances and the limits of speed and effort are positive. (A URDF's limits of speed and effort may be 0.)
//!
//! Right: `rate: 200 Hz;`
//! Wrong: `rate: 0 Hz;`

use super::dimensions::of_limit;
use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::parse::{JointKind, Quantity};
use crate::units::Dimension;

/// Beyond it a period is less than a nanosecond.
const HIGHEST_RATE_HZ: f64 = 1e9;
/// 292 years: beyond it nanoseconds do not fit.
const LONGEST_TIME_S: f64 = 9.2e9;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for rate in robot.sensors.iter().flat_map(|sensor| &sensor.rates) {
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
