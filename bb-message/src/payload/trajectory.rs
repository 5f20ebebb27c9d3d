//! Trajectories of joints.

use crate::message::Payload;
use crate::message::{Exceeded, JointBounds, JointCommand, OutOfBounds, Transmission};
use std::sync::Arc;
use std::time::Duration;

/// A motion of several joints (`trajectory_msgs/JointTrajectory`). It starts at the message's time.
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(ros, joint_command)]
pub struct JointTrajectory {
    /// The joints.
    pub joint_names: Arc<[String]>,
    /// Points in the order of their times.
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
    /// Time from the start of the trajectory.
    pub time_from_start: Duration,
}

/// Precision to which a position of a trajectory is rounded, rad or m: points that are close in time are not too fast for it.
const ROUNDING: f64 = 1e-9;

/// A trajectory that leads one joint beyond its limits is refused as a whole: clamped to them, it would be another one,
/// and this joint would no longer keep step with the others.
///
/// The position, velocity and effort of each point are checked, of each column with the name of the joint, and the mean velocity
/// between each point and the next. How a joint moves between two points is up to its actuator, which may be faster there than at
/// both of them.
impl JointCommand for JointTrajectory {
    fn limit(&mut self, bounds: &JointBounds) -> Result<Exceeded, OutOfBounds> {
        let names = self.joint_names.iter().enumerate();
        for (column, _) in names.filter(|(_, name)| *name == bounds.joint) {
            check_column(&self.points, column, bounds)?;
        }
        Ok(Exceeded::default())
    }

    /// The columns of other joints stay as they are.
    fn at_motor(&self, joint: &str, transmission: &Transmission) -> Option<Self> {
        let mut points = self.points.to_vec();
        for (column, _) in self.joint_names.iter().enumerate().filter(|(_, name)| *name == joint) {
            for point in &mut points {
                let convert = |numbers: &mut Vec<f64>, of: fn(&Transmission, f64) -> f64| {
                    numbers.get_mut(column).into_iter().for_each(|number| *number = of(transmission, *number));
                };
                convert(&mut point.positions, Transmission::motor_position);
                convert(&mut point.velocities, Transmission::motor_velocity);
                convert(&mut point.accelerations, Transmission::motor_velocity);
                convert(&mut point.efforts, Transmission::motor_effort);
            }
        }
        Some(Self { joint_names: self.joint_names.clone(), points: points.into() })
    }
}

fn check_column(points: &[TrajectoryPoint], column: usize, bounds: &JointBounds) -> Result<(), OutOfBounds> {
    for point in points {
        point.positions.get(column).map_or(Ok(()), |position| bounds.check_position(*position))?;
        point.velocities.get(column).map_or(Ok(()), |velocity| bounds.check_velocity(*velocity))?;
        point.efforts.get(column).map_or(Ok(()), |effort| bounds.check_effort(*effort))?;
    }
    let positions = points.iter().filter_map(|point| Some((point.time_from_start, *point.positions.get(column)?)));
    let mut last: Option<(Duration, f64)> = None;
    for (time, position) in positions {
        if let Some((before, from)) = last {
            let (step_s, way) = (time.saturating_sub(before).as_secs_f64(), position - from);
            if way.abs() > bounds.velocity * step_s + ROUNDING {
                bounds.check_velocity(way / step_s)?;
            }
        }
        last = Some((time, position));
    }
    Ok(())
}
