//! An input arrives at least as often as its tolerance demands, unless it is `optional`; otherwise runs would be
//! dropped all the time. (Inputs in step with the driver are as new as they can be.)
//!
//! Right: `input gnss: sensor::base::gnss, within: 250 ms;` where `gnss` has `rate: 10 Hz;`
//! Wrong: `input gnss: sensor::base::gnss, within: 20 ms;`

use crate::diagnostics::Diagnostics;
use crate::language::EstimatorSetting;
use crate::model::{Estimator, Input, PublisherId, Robot};
use crate::parse::Quantity;
use crate::units::{Dimension, time_text};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // An `optional` or a `within` may be among the unread items.
    let estimators = robot.estimators.iter().filter(|estimator| !estimator.is_nested() && robot.complete);
    for estimator in estimators {
        let (own, shared): (Vec<_>, Vec<_>) =
            inputs(robot, estimator).partition(|(input, _)| input.within.is_some());
        for late in own {
            if let Some(within) = &late.0.within {
                report(estimator, within, &[late], diagnostics);
            }
        }
        if let Some(tolerance) = estimator.settings.of(EstimatorSetting::SyncTolerance).next() {
            report(estimator, &tolerance.quantity, &shared, diagnostics);
        }
    }
}

/// The inputs that must not be too old and are not in step with the driver, with the time between their messages.
fn inputs<'a>(robot: &'a Robot, estimator: &'a Estimator) -> impl Iterator<Item = (&'a Input, f64)> {
    let driver = estimator.driver().and_then(|driver| driver.source);
    let must_be_new = estimator.inputs.iter().filter(|input| input.driver.is_none() && input.optional.is_none());
    must_be_new.filter_map(move |input| {
        let source = input.source?;
        let period_s = robot.period_s(source)?;
        let is_in_step = driver.is_some_and(|driver| is_in_step(robot, source, driver));
        (!is_in_step).then_some((input, period_s))
    })
}

/// Returns whether each message of the driving input comes with one of this input: both derive from the same message, or whenever the
/// driver's sensor is due, the other's is due too and read before it.
fn is_in_step(robot: &Robot, source: PublisherId, driver: PublisherId) -> bool {
    if robot.trigger(source) == robot.trigger(driver) {
        return true;
    }
    let (Some(period_s), Some(driver_s)) = (robot.period_s(source), robot.period_s(driver)) else { return false };
    let messages = driver_s / period_s;
    messages.round() >= 1.0 && (messages - messages.round()).abs() < 1e-9 * messages
}

/// A tolerance that is not positive is reported by another rule. Rounding of `1.0 / rate` is not a fault.
fn is_exceeded(tolerance: &Quantity, period_s: f64) -> bool {
    tolerance.dimension == Dimension::TIME
        && tolerance.value > 0.0
        && period_s > tolerance.value * (1.0 + 4.0 * f64::EPSILON)
}

/// One message for a tolerance that is too short, regardless of how many inputs it affects.
fn report(estimator: &Estimator, tolerance: &Quantity, inputs: &[(&Input, f64)], diagnostics: &mut Diagnostics) {
    let late: Vec<_> = inputs.iter().filter(|(_, period_s)| is_exceeded(tolerance, *period_s)).collect();
    let come =
        late.iter().map(|(input, period_s)| format!("`{}` comes every {}", input.name, time_text(*period_s)));
    let come = come.collect::<Vec<_>>().join(" and ");
    let way_out = match &late[..] {
        [] => return,
        [(_, period_s)] => format!("give it `within: {}` or more, or make it `optional`", time_text(*period_s)),
        _ => "give each a `within` of its own that is as long, or make it `optional`".to_owned(),
    };
    let (tolerance_text, name) = (time_text(tolerance.value), &estimator.name);
    let message = format!(
        "{come} but may be no older than {tolerance_text}, so runs of `{name}` would be dropped all the time; {way_out}"
    );
    diagnostics.at(tolerance.place, message);
}
