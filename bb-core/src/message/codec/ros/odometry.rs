//! `nav_msgs`

use super::geometry::{PoseMessage, TwistWithCovariance};
use super::{Header, RosMessage, WORLD, covariance};
use crate::Payload;
use crate::message::{DecodeError, Stamped};
use crate::payload::{Odometry, Pose};
use crate::time::WallTime;

/// `geometry_msgs/msg/PoseWithCovariance`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/PoseWithCovariance")]
pub(super) struct PoseWithCovariance {
    pose: PoseMessage,
    covariance: [f64; 36],
}

/// `nav_msgs/msg/Odometry`
#[derive(Clone, Debug, Payload)]
#[payload(name = "nav_msgs/Odometry")]
pub struct OdometryMessage {
    header: Header,
    child_frame_id: String,
    pose: PoseWithCovariance,
    twist: TwistWithCovariance,
}

impl RosMessage for Odometry {
    type Message = OdometryMessage;

    fn to_ros(message: &Stamped<Self>) -> OdometryMessage {
        let Odometry { pose, twist } = &message.payload;
        OdometryMessage {
            header: Header::in_frame(message, WORLD),
            child_frame_id: message.frame.name().to_owned(),
            pose: PoseWithCovariance {
                pose: PoseMessage::of(pose),
                covariance: covariance::to_ros(&pose.covariance),
            },
            twist: TwistWithCovariance::of(twist),
        }
    }

    fn from_ros(message: OdometryMessage) -> Result<(Self, WallTime), DecodeError> {
        let covariance = covariance::from_ros(&message.pose.covariance);
        let pose = Pose { covariance, ..message.pose.pose.pose() };
        Ok((Self { pose, twist: message.twist.twist() }, message.header.stamp.wall_time()))
    }
}
