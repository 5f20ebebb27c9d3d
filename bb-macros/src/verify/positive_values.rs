//! Rates and tolerances are positive, limits of speed and effort not negative.
//!
//! Right: `rate: 200 Hz;`
//! Wrong: `rate: 0 Hz;`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;
use crate::parse::Quantity;

/// Beyond it a period is less than a nanosecond.
const HIGHEST_RATE_HZ: f64 = 1e9;
/// 292 years: beyond it nanoseconds do not fit.
const LONGEST_TIME_S: f64 = 9.2e9;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    for rate in robot.sensors.iter().flat_map(|sensor| &sensor.rates) {
        positive(&rate.quantity, HIGHEST_RATE_HZ, "1 GHz", diagnostics);
        if rate.quantity.value > 0.0 && 1.0 / rate.quantity.value > LONGEST_TIME_S {
            diagnostics.at(rate.quantity.place, "this rate is too low: less than once in 292 years".into());
        }
    }
    for estimator in &robot.estimators {
        let tolerances = estimator.sync_tolerances.iter().map(|tolerance| &tolerance.quantity);
        for time in tolerances.chain(estimator.inputs.iter().filter_map(|input| input.within.as_ref())) {
            positive(time, LONGEST_TIME_S, "292 years", diagnostics);
        }
    }
    for limit in robot.joints.iter().flat_map(|joint| &joint.limits) {
        for quantity in limit.velocity.iter().chain(&limit.effort) {
            if quantity.value < 0.0 {
                diagnostics.at(quantity.place, "this must not be negative".into());
            }
        }
    }
}

fn positive(quantity: &Quantity, highest: f64, highest_text: &str, diagnostics: &mut Diagnostics) {
    if quantity.value <= 0.0 {
        diagnostics.at(quantity.place, "this must be more than 0".into());
    } else if quantity.value > highest {
        diagnostics.at(quantity.place, format!("this must be at most {highest_text}"));
    }
}
