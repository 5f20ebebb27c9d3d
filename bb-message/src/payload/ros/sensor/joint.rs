//! `sensor_msgs/JointState`, which ROS also uses for commands, with only the commanded lists.

use super::super::ros_message;
use crate::message::{DecodeError, Stamped};
use crate::payload::{EffortCommand, JointSnapshot, JointState, JointStates, PositionCommand, VelocityCommand};
use std::sync::Arc;

ros_message! {
    JointStates => JointStateMessage "sensor_msgs/JointState";
    write(joints) {
        name: Arc<[String]> = Arc::clone(&joints.names),
        position: Vec<f64> = joints.positions.clone(),
        velocity: Vec<f64> = joints.velocities.clone(),
        effort: Vec<f64> = joints.efforts.clone(),
    }
    read { Self { names: name, positions: position, velocities: velocity, efforts: effort } }
}

ros_message! {
    JointSnapshot => JointStateMessage;
    write(joints) {
        name = Arc::clone(&joints.names),
        position = joints.positions.clone(),
        velocity = joints.velocities.clone(),
        effort = joints.efforts.clone(),
    }
    read { Self { names: name, positions: position, velocities: velocity, efforts: effort } }
}

fn at_most_one(name: &'static str, values: &[f64]) -> Result<Option<f64>, DecodeError> {
    match values {
        [] => Ok(None),
        [value] => Ok(Some(*value)),
        several => Err(DecodeError::new(0, "a list of one at most", several.len().to_string()).within(name)),
    }
}

fn one(name: &'static str, values: &[f64]) -> Result<f64, DecodeError> {
    at_most_one(name, values)?.ok_or_else(|| DecodeError::new(0, "a list of one", "an empty one").within(name))
}

fn none(name: &'static str, values: &[f64]) -> Result<(), DecodeError> {
    match values.len() {
        0 => Ok(()),
        length => Err(DecodeError::new(0, "an empty list", length.to_string()).within(name)),
    }
}

fn one_name(names: &[String]) -> Result<(), DecodeError> {
    match names.len() {
        1 => Ok(()),
        length => Err(DecodeError::new(0, "the state of one joint", format!("that of {length}")).within("name")),
    }
}

/// The frame of a payload of one joint names the joint.
fn name_of<T>(message: &Stamped<T>) -> Arc<[String]> {
    Arc::from([message.frame.name().to_owned()])
}

fn list(value: Option<f64>) -> Vec<f64> {
    value.into_iter().collect()
}

ros_message! {
    JointState => JointStateMessage;
    write(joint) {
        name = name_of(joint),
        position = vec![joint.position],
        velocity = list(joint.velocity),
        effort = list(joint.effort),
    }
    read {
        one_name(&name)?;
        Self {
            position: one("position", &position)?,
            velocity: at_most_one("velocity", &velocity)?,
            effort: at_most_one("effort", &effort)?,
        }
    }
}

ros_message! {
    PositionCommand => JointStateMessage;
    write(command) {
        name = name_of(command),
        position = vec![command.position],
        velocity = list(command.velocity),
        effort = list(command.effort),
    }
    read {
        one_name(&name)?;
        Self {
            position: one("position", &position)?,
            velocity: at_most_one("velocity", &velocity)?,
            effort: at_most_one("effort", &effort)?,
        }
    }
}

ros_message! {
    VelocityCommand => JointStateMessage;
    write(command) {
        name = name_of(command),
        position = Vec::new(),
        velocity = vec![command.velocity],
        effort = list(command.effort),
    }
    read {
        one_name(&name)?;
        none("position", &position)?;
        Self { velocity: one("velocity", &velocity)?, effort: at_most_one("effort", &effort)? }
    }
}

ros_message! {
    EffortCommand => JointStateMessage;
    write(command) {
        name = name_of(command),
        position = Vec::new(),
        velocity = Vec::new(),
        effort = vec![command.effort],
    }
    read {
        one_name(&name)?;
        none("position", &position)?;
        none("velocity", &velocity)?;
        Self { effort: one("effort", &effort)? }
    }
}
