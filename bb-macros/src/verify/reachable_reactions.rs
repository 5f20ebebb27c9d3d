//! `on_lost` needs `lost_after`: without it an estimator is never lost.
//!
//! Right: `lost_after: 100 ms; on_lost: stop;`
//! Wrong: `on_lost: stop;` alone
//!
//! `on_degraded` needs nothing: any estimator degrades when it is restarted.

use crate::diagnostics::Diagnostics;
use crate::model::Robot;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // The time may be among the unread items.
    for estimator in robot.estimators.iter().filter(|_| robot.complete) {
        if estimator.timing.lost_after_s.is_some() {
            continue;
        }
        for reaction in &estimator.reactions.on_lost {
            let message = format!(
                "`{}` is never lost, since it has no `lost_after`; say how long it may wait for its input, as in \
                 `lost_after: 100 ms;`",
                estimator.name
            );
            diagnostics.error(&reaction.word, message);
        }
    }
}
