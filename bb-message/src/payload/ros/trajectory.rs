//! `trajectory_msgs`

use super::{DurationMessage, ros_message};
use crate::message::DecodeError;
use crate::message::Payload;
use crate::payload::{JointTrajectory, TrajectoryPoint};
use std::sync::Arc;

/// `trajectory_msgs/JointTrajectoryPoint`
#[derive(Clone, Debug, Payload)]
#[payload(name = "trajectory_msgs/JointTrajectoryPoint")]
struct PointMessage {
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    effort: Vec<f64>,
    time_from_start: DurationMessage,
}

impl PointMessage {
    fn of(point: &TrajectoryPoint) -> Self {
        let TrajectoryPoint { positions, velocities, accelerations, efforts, time_from_start } = point.clone();
        let time_from_start = DurationMessage::of(time_from_start);
        Self { positions, velocities, accelerations, effort: efforts, time_from_start }
    }

    fn point(self) -> Result<TrajectoryPoint, DecodeError> {
        let Self { positions, velocities, accelerations, effort, time_from_start } = self;
        let time_from_start = time_from_start.duration().map_err(|error| error.within("time_from_start"))?;
        Ok(TrajectoryPoint { positions, velocities, accelerations, efforts: effort, time_from_start })
    }
}

ros_message! {
    JointTrajectory => JointTrajectoryMessage "trajectory_msgs/JointTrajectory";
    write(trajectory) {
        joint_names: Arc<[String]> = Arc::clone(&trajectory.joint_names),
        points: Vec<PointMessage> = trajectory.points.iter().map(PointMessage::of).collect(),
    }
    read {
        let points = points.into_iter().enumerate().map(|(index, point)| {
            point.point().map_err(|error| error.at_index(index).within("points"))
        });
        Self { joint_names, points: points.collect::<Result<_, _>>()? }
    }
}
