//! The state of joints.

use crate::Payload;
use std::sync::Arc;

/// The state of one joint (one row of `sensor_msgs/JointState`; the message's frame names the joint).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros, joint_position)]
pub struct JointState {
    /// Angle in rad of a revolute or continuous joint; displacement in m of a prismatic one.
    pub position: f64,
    /// rad/s or m/s.
    pub velocity: Option<f64>,
    /// Torque in N·m or force in N.
    pub effort: Option<f64>,
}

/// The state of several joints (`sensor_msgs/JointState`). Each list is as long as the names, or empty where its quantity
/// is not measured.
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
