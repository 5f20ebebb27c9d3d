//! An input comes at least as often as its tolerance demands, unless it is `optional`: else most runs would be dropped.
//!
//! Right: `input gnss: sensor::base::gnss, within: 250 ms;` where `gnss` has `rate: 10 Hz;`
//! Wrong: `input gnss: sensor::base::gnss, within: 20 ms;`

use crate::diagnostics::Diagnostics;
use crate::model::{Estimator, Input, Robot};
use crate::parse::Quantity;
use crate::units::{Dimension, time_text};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // What could not be read may be an `optional` or a `within`.
    let estimators = robot.estimators.iter().filter(|estimator| !estimator.is_nested() && robot.complete);
    for estimator in estimators {
        let sync_tolerance = estimator.sync_tolerances.first().map(|tolerance| &tolerance.quantity);
        // Of those that one tolerance is too short for, the slowest tells how long it must be.
        let mut slowest: Option<(&Input, f64)> = None;
        for (input, period_s) in inputs(robot, estimator) {
            match &input.within {
                Some(within) if is_exceeded(within, period_s) => {
                    let message = message(estimator, input, period_s, within, "allow");
                    diagnostics.at(within.place, message);
                }
                Some(_) => {}
                None if slowest.is_none_or(|(_, other)| period_s > other) => slowest = Some((input, period_s)),
                None => {}
            }
        }
        if let (Some(tolerance), Some((input, period_s))) = (sync_tolerance, slowest)
            && is_exceeded(tolerance, period_s)
        {
            let message = message(estimator, input, period_s, tolerance, "give it a `within` of");
            diagnostics.at(tolerance.place, message);
        }
    }
}

/// The inputs that must not be too old, with the time between their messages. What comes from the same message as the
/// driver is in step with it.
fn inputs<'a>(robot: &'a Robot, estimator: &'a Estimator) -> impl Iterator<Item = (&'a Input, f64)> {
    let driver = estimator.driver().and_then(|driver| robot.trigger(driver.source?));
    estimator.inputs.iter().filter_map(move |input| {
        let source = input.source?;
        let may_miss = input.driver.is_none() && input.optional.is_none() && robot.trigger(source) != driver;
        Some((input, robot.period_s(source)?)).filter(|_| may_miss)
    })
}

/// A tolerance that is no positive time is a fault of its own. The rounding of `1.0 / rate` is none.
fn is_exceeded(tolerance: &Quantity, period_s: f64) -> bool {
    tolerance.dimension == Dimension::TIME
        && tolerance.value > 0.0
        && period_s > tolerance.value * (1.0 + 4.0 * f64::EPSILON)
}

fn message(estimator: &Estimator, input: &Input, period_s: f64, tolerance: &Quantity, remedy: &str) -> String {
    let (period, tolerance) = (time_text(period_s), time_text(tolerance.value));
    format!(
        "`{}` comes every {period} but may be no older than {tolerance}, so most runs of `{}` would be dropped; \
         {remedy} {period} or more, or make it `optional`",
        input.name, estimator.name
    )
}
