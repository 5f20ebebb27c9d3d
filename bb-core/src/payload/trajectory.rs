//! Trajectories of joints.

use crate::Payload;
use crate::message::{Exceeded, JointBounds, JointCommand, OutOfBounds};
use std::sync::Arc;
use std::time::Duration;

/// A motion of several joints (`trajectory_msgs/JointTrajectory`). It starts at the message's time.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(ros, joint_command)]
pub struct JointTrajectory {
    /// The joints.
    pub joint_names: Arc<[String]>,
    /// In the order of their times.
    pub points: Arc<[TrajectoryPoint]>,
}

/// The state of a trajectory's joints at one time. Each list is as long as the names of the joints, or empty if its
/// quantity is free.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
pub struct TrajectoryPoint {
    /// rad or m
    pub positions: Vec<f64>,
    /// rad/s or m/s
    pub velocities: Vec<f64>,
    /// rad/s² or m/s²
    pub accelerations: Vec<f64>,
    /// N·m or N
    pub efforts: Vec<f64>,
    /// From the start of the trajectory.
    pub time_from_start: Duration,
}

/// A trajectory that leads one joint beyond its limits is refused as a whole: clamping would change it, and this
/// joint would lose step with the others.
impl JointCommand for JointTrajectory {
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        let Some(joint) = self.joint_names.iter().position(|name| name == bounds.joint) else {
            return Ok(Exceeded::default());
        };
        for point in self.points.iter() {
            point.positions.get(joint).map_or(Ok(()), |position| bounds.check_position(*position))?;
            point.velocities.get(joint).map_or(Ok(()), |velocity| bounds.check_velocity(*velocity))?;
            point.efforts.get(joint).map_or(Ok(()), |effort| bounds.check_effort(*effort))?;
        }
        Ok(Exceeded::default())
    }
}
