//! A joint with an actuator has a source of its position: a sensor of its own, or another joint that it follows. (A fixed
//! one has no position.)
//!
//! Right: `joint pan: revolute { …; actuator servo: Servo(); sensor encoder: Encoder(); link head { } }`
//! Wrong: `joint pan: revolute { …; actuator servo: Servo(); link head { } }`

use crate::diagnostics::Diagnostics;
use crate::model::{Mount, Robot};
use crate::parse::JointKind;

pub(super) fn check(robot: &Robot, diagnostics: &mut Diagnostics) {
    // The sensor may be what could not be read.
    for actuator in robot.actuators.iter().filter(|_| robot.complete) {
        let Some(joint) = robot.joints.get(actuator.joint) else { continue };
        let has_position = joint.kind == JointKind::Fixed || !joint.mimics.is_empty();
        if has_position || robot.sensors.iter().any(|sensor| sensor.mount == Mount::Joint(actuator.joint)) {
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
