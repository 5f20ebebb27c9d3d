//! `sync_tolerance` needs several inputs.
//!
//! Right: two inputs and `sync_tolerance: 20 ms;`
//! Wrong: one input and `sync_tolerance: 20 ms;`

use crate::diagnostics::Diagnostics;
use crate::language::EstimatorSetting;
use crate::model::Robot;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let single = robot.estimators.iter().filter(|estimator| !estimator.is_nested() && estimator.inputs.len() == 1);
    for tolerance in single
        .filter(|_| robot.complete)
        .flat_map(|estimator| estimator.settings.of(EstimatorSetting::SyncTolerance))
    {
        let message = "there is a single input, and nothing for it to be in step with; add the other input, or leave this out";
        diagnostics.error(&tolerance.word, message.into());
    }
}
