//! A joint with an actuator has a source of its position: its own sensor, or an estimator in one, that publishes a
//! payload reporting it; or another joint that it follows. (A fixed joint has no position.)
//!
//! Right: `joint pan: revolute { …; actuator servo: Servo(); sensor encoder: Encoder(); link head { } }`
//! Wrong: `joint pan: revolute { …; actuator servo: Servo(); link head { } }`
//!
//! The payload of a sensor is a fact about its type: `expand::checks` makes `bb_core` check that.

use crate::diagnostics::Diagnostics;
use crate::model::Robot;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // The sensor may be among the unread items.
    for actuator in robot.actuators.iter().filter(|_| robot.complete) {
        let joint = &robot.joints[actuator.joint];
        if robot.position_sources(actuator.joint).is_none_or(|sources| !sources.is_empty()) {
            continue;
        }
        let message = format!(
            "`{}` moves the joint `{}`, whose position nothing measures; declare a sensor in this joint, as in `sensor \
             encoder: Encoder();`",
            actuator.name, joint.name
        );
        diagnostics.error(&actuator.name, message);
    }
}
