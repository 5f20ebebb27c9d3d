//! Commands to an actuator, and its reports of a motion. The message's frame names the joint.

use super::JointTrajectory;
use crate::message::Payload;
use crate::message::{Exceeded, JointBounds, JointCommand, OutOfBounds, Transmission};
use crate::time::MonotonicTime;

/// A command to an actuator that takes all standard commands. The limits of the joint are applied before it gets one.
#[derive(Clone, Debug, PartialEq, Payload)]
#[payload(joint_command)]
pub enum ActuatorCommand {
    /// Go to a position.
    Position(PositionCommand),
    /// Move at a velocity.
    Velocity(VelocityCommand),
    /// Apply an effort.
    Effort(EffortCommand),
    /// Follow, from now on, the points of a trajectory that belong to the joint.
    Trajectory(JointTrajectory),
    /// Come to rest as fast as the joint may, and hold that position.
    Hold,
    /// Come to rest as fast as the joint may; then the actuator applies no effort.
    Stop,
}

/// Move a joint to a position (`sensor_msgs/JointState` with the values that are set).
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
#[payload(ros, joint_command)]
pub struct PositionCommand {
    /// Angle in rad of a revolute or continuous joint; displacement in m of a prismatic one.
    #[payload(unit = "rad", unit = "m")]
    pub position: f64,
    /// Velocity at the target; for an actuator that only takes a speed, the speed of the motion is its magnitude: the sign is
    /// the other one at a motor whose transmission is `reversed`. rad/s or m/s.
    #[payload(unit = "rad/s", unit = "m/s")]
    pub velocity: Option<f64>,
    /// Effort to add to the actuator's own control: N·m or N.
    #[payload(unit = "N*m", unit = "N")]
    pub effort: Option<f64>,
}

/// Move a joint at a velocity (`sensor_msgs/JointState` with a velocity and no position).
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
#[payload(ros, joint_command)]
pub struct VelocityCommand {
    /// rad/s or m/s.
    #[payload(unit = "rad/s", unit = "m/s")]
    pub velocity: f64,
    /// Effort to add to the actuator's own control: N·m or N.
    #[payload(unit = "N*m", unit = "N")]
    pub effort: Option<f64>,
}

/// Apply an effort to a joint (`sensor_msgs/JointState` with an effort alone).
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
#[payload(ros, joint_command)]
pub struct EffortCommand {
    /// Torque in N·m or force in N.
    #[payload(unit = "N*m", unit = "N")]
    pub effort: f64,
}

/// An actuator begins to move a joint. An open-loop estimator uses it to follow a joint without an encoder.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct BeginMotion {
    /// Position at the start, rad or m.
    #[payload(unit = "rad", unit = "m")]
    pub initial_position: f64,
    /// Position at the end, rad or m; `None` if the motion goes on until another command, as that of a velocity or an effort
    /// on a joint without an end of its range.
    #[payload(unit = "rad", unit = "m")]
    pub target_position: Option<f64>,
    /// Velocity, if one is commanded, rad/s or m/s; negative if it leads to smaller positions.
    #[payload(unit = "rad/s", unit = "m/s")]
    pub velocity: Option<f64>,
    /// Speed of the motion, if known, rad/s or m/s; never negative.
    #[payload(unit = "rad/s", unit = "m/s")]
    pub speed: Option<f64>,
    /// Time at which the joint is expected to arrive.
    pub expected_arrival: Option<MonotonicTime>,
}

/// An actuator has ended a motion.
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct EndMotion {
    /// Position at the end, measured or assumed, rad or m.
    #[payload(unit = "rad", unit = "m")]
    pub position: f64,
    /// Reason for the end of the motion.
    pub end: MotionEnd,
}

impl BeginMotion {
    /// The motion of the joint, from that of its motor.
    #[doc(hidden)]
    pub fn at_joint(self, transmission: &Transmission) -> Self {
        Self {
            initial_position: transmission.joint_position(self.initial_position),
            target_position: self.target_position.map(|target| transmission.joint_position(target)),
            velocity: self.velocity.map(|velocity| transmission.joint_velocity(velocity)),
            speed: self.speed.map(|speed| transmission.joint_velocity(speed).abs()),
            expected_arrival: self.expected_arrival,
        }
    }
}

/// Reason for the end of a motion.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub enum MotionEnd {
    /// The joint has reached the target.
    Reached,
    /// Another command replaced the motion.
    Replaced,
    /// The actuator got a command to hold or to stop, or was disarmed.
    Stopped,
    /// The actuator applies its maximum effort, and the joint does not move: something blocks it.
    Stalled,
    /// The joint is at the end of its range, short of the target.
    Limit,
    /// The actuator failed, was restarted or could not be disarmed; the reason.
    Failed(String),
}

impl JointCommand for ActuatorCommand {
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        match self {
            Self::Position(command) => command.limit(bounds),
            Self::Velocity(command) => command.limit(bounds),
            Self::Effort(command) => command.limit(bounds),
            Self::Trajectory(command) => command.limit(bounds),
            Self::Hold | Self::Stop => Ok(Exceeded::default()),
        }
    }

    fn stop() -> Option<Self> {
        Some(Self::Hold)
    }

    fn at_motor(&self, joint: &str, transmission: &Transmission) -> Option<Self> {
        Some(match self {
            Self::Position(command) => Self::Position(command.at_motor(joint, transmission)?),
            Self::Velocity(command) => Self::Velocity(command.at_motor(joint, transmission)?),
            Self::Effort(command) => Self::Effort(command.at_motor(joint, transmission)?),
            Self::Trajectory(command) => Self::Trajectory(command.at_motor(joint, transmission)?),
            Self::Hold => Self::Hold,
            Self::Stop => Self::Stop,
        })
    }
}

impl JointCommand for PositionCommand {
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        let mut exceeded = Exceeded::default();
        bounds.hold_position(&mut self.position, &mut exceeded);
        // The velocity at the target, or a speed: the joint's position does not matter.
        let bounds = JointBounds { position: None, ..*bounds };
        self.velocity.iter_mut().for_each(|velocity| bounds.hold_velocity(velocity, &mut exceeded));
        self.effort.iter_mut().for_each(|effort| bounds.hold_effort(effort, &mut exceeded));
        Ok(exceeded)
    }

    fn at_motor(&self, _: &str, transmission: &Transmission) -> Option<Self> {
        Some(Self {
            position: transmission.motor_position(self.position),
            velocity: self.velocity.map(|velocity| transmission.motor_velocity(velocity)),
            effort: self.effort.map(|effort| transmission.motor_effort(effort)),
        })
    }
}

impl JointCommand for VelocityCommand {
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        let mut exceeded = Exceeded::default();
        bounds.hold_velocity(&mut self.velocity, &mut exceeded);
        self.effort.iter_mut().for_each(|effort| bounds.hold_effort(effort, &mut exceeded));
        Ok(exceeded)
    }

    fn stop() -> Option<Self> {
        Some(Self::default())
    }

    fn at_motor(&self, _: &str, transmission: &Transmission) -> Option<Self> {
        Some(Self {
            velocity: transmission.motor_velocity(self.velocity),
            effort: self.effort.map(|effort| transmission.motor_effort(effort)),
        })
    }
}

impl JointCommand for EffortCommand {
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        let mut exceeded = Exceeded::default();
        bounds.hold_effort(&mut self.effort, &mut exceeded);
        Ok(exceeded)
    }

    fn at_motor(&self, _: &str, transmission: &Transmission) -> Option<Self> {
        Some(Self { effort: transmission.motor_effort(self.effort) })
    }

    /// No effort: the joint is left to itself, which is safer than the last effort for ever.
    fn stop() -> Option<Self> {
        Some(Self::default())
    }
}

impl From<PositionCommand> for ActuatorCommand {
    fn from(command: PositionCommand) -> Self {
        Self::Position(command)
    }
}

impl From<VelocityCommand> for ActuatorCommand {
    fn from(command: VelocityCommand) -> Self {
        Self::Velocity(command)
    }
}

impl From<EffortCommand> for ActuatorCommand {
    fn from(command: EffortCommand) -> Self {
        Self::Effort(command)
    }
}

impl From<JointTrajectory> for ActuatorCommand {
    fn from(command: JointTrajectory) -> Self {
        Self::Trajectory(command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_that_would_go_on_for_ever_have_one_that_stops() {
        assert_eq!(ActuatorCommand::stop(), Some(ActuatorCommand::Hold));
        assert_eq!(VelocityCommand::stop(), Some(VelocityCommand { velocity: 0.0, effort: None }));
        assert_eq!(EffortCommand::stop(), Some(EffortCommand { effort: 0.0 }));
        assert_eq!(PositionCommand::stop(), None);
    }
}
