//! `nav_msgs`

use super::geometry::{PoseMessage, PoseWithCovarianceMessage, TwistWithCovarianceMessage};
use super::{Header, Time, WORLD, ros_message};
use crate::message::Payload;
use crate::payload::{Odometry, Path, PathPose};

ros_message! {
    Odometry => OdometryMessage "nav_msgs/Odometry" in WORLD;
    write(odometry) {
        child_frame_id: String = odometry.frame.name().to_owned(),
        pose: PoseWithCovarianceMessage = PoseWithCovarianceMessage::of(&odometry.pose),
        twist: TwistWithCovarianceMessage = TwistWithCovarianceMessage::of(&odometry.twist),
    }
    read {
        // As for every payload, the frame comes from the recording's channel.
        drop(child_frame_id);
        Self { pose: pose.pose(), twist: twist.twist() }
    }
}

/// `geometry_msgs/PoseStamped`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/PoseStamped")]
struct PathPoseMessage {
    header: Header,
    pose: PoseMessage,
}

impl PathPoseMessage {
    fn of(pose: &PathPose) -> Self {
        Self {
            header: Header { stamp: Time::of(pose.time), frame_id: WORLD.to_owned() },
            pose: PoseMessage::of(pose.position, pose.world_from_body),
        }
    }

    fn pose(&self) -> PathPose {
        PathPose {
            time: self.header.stamp.wall_time(),
            position: self.pose.position(),
            world_from_body: self.pose.orientation(),
        }
    }
}

ros_message! {
    Path => PathMessage "nav_msgs/Path" in WORLD;
    write(path) { poses: Vec<PathPoseMessage> = path.poses.iter().map(PathPoseMessage::of).collect(), }
    read { Self { poses: poses.iter().map(PathPoseMessage::pose).collect() } }
}
