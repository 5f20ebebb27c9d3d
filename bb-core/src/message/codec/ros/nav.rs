//! `nav_msgs`

use super::WORLD;
use super::geometry::{PoseWithCovarianceMessage, TwistWithCovarianceMessage};
use crate::payload::Odometry;

ros_message! {
    Odometry => OdometryMessage "nav_msgs/Odometry" in WORLD;
    write(odometry) {
        child_frame_id: String = odometry.frame.name().to_owned(),
        pose: PoseWithCovarianceMessage = PoseWithCovarianceMessage::of(&odometry.pose),
        twist: TwistWithCovarianceMessage = TwistWithCovarianceMessage::of(&odometry.twist),
    }
    read {
        // The frame is the message's own, as that of every payload is.
        drop(child_frame_id);
        Self { pose: pose.pose(), twist: twist.twist() }
    }
}
