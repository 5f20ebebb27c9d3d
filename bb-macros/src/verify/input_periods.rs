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
        let (own, shared): (Vec<_>, Vec<_>) =
            inputs(robot, estimator).partition(|(input, _)| input.within.is_some());
        for late in own {
            if let Some(within) = &late.0.within {
                report(estimator, within, &[late], diagnostics);
            }
        }
        if let Some(tolerance) = estimator.sync_tolerances.first() {
            report(estimator, &tolerance.quantity, &shared, diagnostics);
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

/// One message for a tolerance that is too short, however many inputs it is too short for.
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
        "{come} but may be no older than {tolerance_text}, so most runs of `{name}` would be dropped; {way_out}"
    );
    diagnostics.at(tolerance.place, message);
}
