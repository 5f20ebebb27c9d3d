//! The state of a joint.

use crate::Payload;

/// The state of one joint (one row of `sensor_msgs/JointState`; the message's frame names the joint).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct JointState {
    /// Angle in rad of a revolute or continuous joint; displacement in m of a prismatic one.
    pub position: f64,
    /// rad/s or m/s.
    pub velocity: Option<f64>,
    /// Torque in N·m or force in N.
    pub effort: Option<f64>,
}
