//! An estimator on a link has at least one input.
//!
//! Right: `link base { estimator pose: Eskf() { input imu: sensor::base::imu; } }`
//! Wrong: `link base { estimator pose: Eskf(); }`

use crate::diagnostics::Diagnostics;
use crate::model::{Mount, Robot};

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    let missing = robot.estimators.iter().filter(|estimator| !estimator.is_nested() && estimator.inputs.is_empty());
    let example = robot
        .sensors
        .iter()
        .find(|sensor| sensor.mount != Mount::Robot)
        .map(|sensor| &robot.publishers[sensor.publisher]);
    let example = example.map_or("sensor::base::imu".to_owned(), |publisher| publisher.path.join("::"));
    for estimator in missing.filter(|_| robot.complete) {
        let name = &estimator.name;
        let message = format!(
            "the estimator `{name}` on a link has no input; declare one, as in `input {}: {example};`",
            example.rsplit("::").next().unwrap_or_default()
        );
        diagnostics.error(name, message);
    }
}
