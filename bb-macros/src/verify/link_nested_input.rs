//! An estimator on a link has at least one input.
//!
//! Right: `link base { estimator pose: Eskf() { input imu: sensor::base::imu; } }`
//! Wrong: `link base { estimator pose: Eskf(); }`

use crate::diagnostics::Diagnostics;
use crate::model::Robot;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let missing = robot.estimators.iter().filter(|estimator| !estimator.is_nested() && estimator.inputs.is_empty());
    for estimator in missing.filter(|_| robot.complete) {
        let name = &estimator.name;
        let message = format!(
            "the estimator `{name}` on a link has no input; declare one, as in `input imu: sensor::{}::imu;`",
            robot.links.first().map_or("base".to_owned(), |link| link.name.to_string())
        );
        diagnostics.error(name, message);
    }
}
