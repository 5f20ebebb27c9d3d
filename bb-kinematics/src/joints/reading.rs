//! Converts a joint reading in a message to the joint's state.

use crate::topology::Joint;
use bb_message::message::{JointReading, JointSide};

/// Buffer for the numbers of a converted reading.
#[derive(Debug, Default)]
pub(super) struct Converted {
    position: [f64; 1],
    velocity: [f64; 1],
    effort: [f64; 1],
}

/// Returns the reading at the joint: the transmission of `joint` is undone if the reading was measured at the motor.
pub(super) fn at_joint<'a>(
    joint: &Joint,
    reading: &JointReading<'a>,
    converted: &'a mut Converted,
) -> JointReading<'a> {
    let (JointSide::Motor, Some(transmission)) = (reading.side, joint.transmission) else { return *reading };
    let ([position], true, true) = (reading.position, reading.velocity.len() < 2, reading.effort.len() < 2) else {
        return *reading;
    };
    converted.position = [transmission.joint_position(*position)];
    let velocity = reading.velocity.first().map(|velocity| [transmission.joint_velocity(*velocity)]);
    let effort = reading.effort.first().map(|effort| [transmission.joint_effort(*effort)]);
    converted.velocity = velocity.unwrap_or_default();
    converted.effort = effort.unwrap_or_default();
    JointReading {
        position: &converted.position,
        velocity: &converted.velocity[..reading.velocity.len()],
        effort: &converted.effort[..reading.effort.len()],
        side: JointSide::Joint,
        joint: reading.joint,
    }
}
