//! Commands to an actuator, and its reports of a motion. The message's frame names the joint.

use crate::Payload;
use crate::time::MonotonicTime;

/// Move a joint to a position (`sensor_msgs/JointState` with the values that are set).
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
#[payload(ros)]
pub struct PositionCommand {
    /// Angle in rad of a revolute or continuous joint; displacement in m of a prismatic one.
    pub position: f64,
    /// Velocity at the target, or the speed of the motion for an actuator that only takes that: rad/s or m/s.
    pub velocity: Option<f64>,
    /// Effort to add to that of the actuator's own control: N·m or N.
    pub effort: Option<f64>,
}

/// Move a joint at a velocity (`sensor_msgs/JointState` with a velocity and no position).
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
#[payload(ros)]
pub struct VelocityCommand {
    /// rad/s or m/s.
    pub velocity: f64,
    /// Effort to add to that of the actuator's own control: N·m or N.
    pub effort: Option<f64>,
}

/// Apply an effort to a joint (`sensor_msgs/JointState` with an effort alone).
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
#[payload(ros)]
pub struct EffortCommand {
    /// Torque in N·m or force in N.
    pub effort: f64,
}

/// An actuator begins to move a joint. An open-loop estimator follows a joint without an encoder from it.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct BeginMotion {
    /// Position at the start, rad or m.
    pub initial_position: f64,
    /// Position at the end, rad or m.
    pub target_position: f64,
    /// Speed of the motion where it is known, rad/s or m/s; never negative.
    pub speed: Option<f64>,
    /// When the joint is expected to arrive.
    pub expected_arrival: Option<MonotonicTime>,
}

/// An actuator has ended a motion.
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct EndMotion {
    /// Position at the end, measured or assumed, rad or m.
    pub position: f64,
    /// Why the motion ended.
    pub end: MotionEnd,
}

/// Why a motion ended.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub enum MotionEnd {
    /// The joint is at the target.
    Reached,
    /// Another command replaced the motion.
    Replaced,
    /// The actuator was told to stop, or was disarmed.
    Stopped,
    /// The joint is at a limit or held by something.
    Blocked,
    /// The actuator failed, with its reason.
    Failed(String),
}
