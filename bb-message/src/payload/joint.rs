//! The state of joints.

use crate::message::Payload;
use crate::message::{JointPositions, JointReading, JointSide};
use std::sync::Arc;

/// The state of one joint (one row of `sensor_msgs/JointState`; the message's frame names the joint).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros, joint_position)]
pub struct JointState {
    /// Angle in rad of a revolute or continuous joint; displacement in m of a prismatic one.
    #[payload(unit = "rad", unit = "m")]
    pub position: f64,
    /// rad/s or m/s.
    #[payload(unit = "rad/s", unit = "m/s")]
    pub velocity: Option<f64>,
    /// Torque in N·m or force in N.
    #[payload(unit = "N*m", unit = "N")]
    pub effort: Option<f64>,
}

/// The state of the motor of a joint with a `transmission`: the reading of an encoder on the motor's side of the
/// gear. The runtime converts it to the joint's, see `joints`.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(joint_position)]
pub struct MotorState {
    /// Angle of the motor in rad.
    #[payload(unit = "rad")]
    pub position: f64,
    /// rad/s.
    #[payload(unit = "rad/s")]
    pub velocity: Option<f64>,
    /// Torque of the motor in N·m.
    #[payload(unit = "N*m")]
    pub effort: Option<f64>,
}

/// The state of several joints (`sensor_msgs/JointState`). Each list is as long as the names, or empty if its
/// quantity is not measured.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(ros, joint_position)]
pub struct JointStates {
    /// The joints.
    pub names: Arc<[String]>,
    /// Angles in rad of revolute and continuous joints; displacements in m of prismatic ones.
    pub positions: Vec<f64>,
    /// rad/s or m/s.
    pub velocities: Vec<f64>,
    /// Torques in N·m or forces in N.
    pub efforts: Vec<f64>,
}

/// All joints of a robot at one time, as the runtime knows them (`sensor_msgs/JointState`); published by
/// `JointPublisher`. Unlike [`JointStates`], it is not a measurement.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(ros, no_frame)]
pub struct JointSnapshot {
    /// The joints whose state is known, in the order of their declaration, including those that mimic others.
    pub names: Arc<[String]>,
    /// Angles in rad of revolute and continuous joints; displacements in m of prismatic ones.
    pub positions: Vec<f64>,
    /// rad/s or m/s; empty if one of them is not measured.
    pub velocities: Vec<f64>,
    /// Torques in N·m or forces in N; empty if one of them is not measured.
    pub efforts: Vec<f64>,
}

impl JointStates {
    /// The state of a joint. `None` if the joint is not listed or its position is not measured.
    pub fn joint(&self, name: &str) -> Option<JointState> {
        let index = self.names.iter().position(|other| other == name)?;
        Some(JointState {
            position: *self.positions.get(index)?,
            velocity: self.velocities.get(index).copied(),
            effort: self.efforts.get(index).copied(),
        })
    }
}

impl JointPositions for JointState {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        let Self { position, velocity, effort } = self;
        tell_one(None, JointSide::Joint, *position, *velocity, *effort, listener);
    }
}

impl JointPositions for MotorState {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        let Self { position, velocity, effort } = self;
        tell_one(None, JointSide::Motor, *position, *velocity, *effort, listener);
    }
}

impl JointPositions for JointStates {
    fn tell(&self, listener: &mut dyn FnMut(JointReading<'_>)) {
        for (index, (name, position)) in self.names.iter().zip(&self.positions).enumerate() {
            let velocity = self.velocities.get(index).copied();
            let effort = self.efforts.get(index).copied();
            tell_one(Some(name), JointSide::Joint, *position, velocity, effort, listener);
        }
    }
}

fn tell_one(
    joint: Option<&str>,
    side: JointSide,
    position: f64,
    velocity: Option<f64>,
    effort: Option<f64>,
    listener: &mut dyn FnMut(JointReading<'_>),
) {
    let (velocity, effort) = (velocity.as_ref(), effort.as_ref());
    listener(JointReading {
        joint,
        position: &[position],
        velocity: velocity.map_or(&[], std::slice::from_ref),
        effort: effort.map_or(&[], std::slice::from_ref),
        side,
    });
}
