//! `geometry_msgs`

use super::{Header, RosMessage, WORLD, covariance};
use crate::Payload;
use crate::message::codec::{Field, FieldShape, Reader, Shape, StructShape, Writer};
use crate::message::{DecodeError, Finite, Stamped};
use crate::payload::{Orientation, Pose, Twist};
use crate::time::WallTime;
use nalgebra::{UnitQuaternion, Vector3};

/// `geometry_msgs/msg/QuaternionStamped`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/QuaternionStamped")]
pub struct QuaternionStamped {
    header: Header,
    quaternion: UnitQuaternion<f64>,
}

impl RosMessage for Orientation {
    type Message = QuaternionStamped;

    fn to_ros(message: &Stamped<Self>) -> QuaternionStamped {
        QuaternionStamped { header: Header::in_frame(message, WORLD), quaternion: message.world_from_body }
    }

    fn from_ros(message: QuaternionStamped) -> Result<(Self, WallTime), DecodeError> {
        Ok((Self::new(message.quaternion), message.header.stamp.wall_time()))
    }
}

/// `geometry_msgs/msg/Point`
#[derive(Clone, Copy, Debug)]
pub(super) struct Point(Vector3<f64>);

impl Finite for Point {
    fn is_finite(&self) -> bool {
        self.0.is_finite()
    }
}

impl Field for Point {
    const SHAPE: Shape = Shape::Struct(&StructShape {
        name: "geometry_msgs/Point",
        fields: &[
            FieldShape::new("x", Shape::F64),
            FieldShape::new("y", Shape::F64),
            FieldShape::new("z", Shape::F64),
        ],
    });
    const IS_INLINE: bool = true;
    fn write(&self, writer: &mut Writer<'_>) {
        self.0.write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Vector3::read(reader).map(Self)
    }
}

/// `geometry_msgs/msg/Pose`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/Pose")]
pub(super) struct PoseMessage {
    position: Point,
    orientation: UnitQuaternion<f64>,
}

impl PoseMessage {
    pub(super) fn of(pose: &Pose) -> Self {
        Self { position: Point(pose.position), orientation: pose.world_from_body }
    }

    pub(super) fn pose(&self) -> Pose {
        Pose { position: self.position.0, world_from_body: self.orientation, covariance: None }
    }
}

/// `geometry_msgs/msg/PoseStamped`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/PoseStamped")]
pub struct PoseStamped {
    header: Header,
    pose: PoseMessage,
}

impl RosMessage for Pose {
    type Message = PoseStamped;

    fn to_ros(message: &Stamped<Self>) -> PoseStamped {
        PoseStamped { header: Header::in_frame(message, WORLD), pose: PoseMessage::of(message) }
    }

    fn from_ros(message: PoseStamped) -> Result<(Self, WallTime), DecodeError> {
        Ok((message.pose.pose(), message.header.stamp.wall_time()))
    }
}

/// `geometry_msgs/msg/Twist`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/Twist")]
pub(super) struct TwistMessage {
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

/// `geometry_msgs/msg/TwistWithCovariance`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/TwistWithCovariance")]
pub(super) struct TwistWithCovariance {
    twist: TwistMessage,
    covariance: [f64; 36],
}

impl TwistWithCovariance {
    pub(super) fn of(twist: &Twist) -> Self {
        let Twist { linear, angular, covariance } = twist;
        let twist = TwistMessage { linear: *linear, angular: *angular };
        Self { twist, covariance: covariance::to_ros(covariance) }
    }

    pub(super) fn twist(&self) -> Twist {
        let TwistMessage { linear, angular } = self.twist;
        Twist { linear, angular, covariance: covariance::from_ros(&self.covariance) }
    }
}

/// `geometry_msgs/msg/TwistWithCovarianceStamped`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/TwistWithCovarianceStamped")]
pub struct TwistStamped {
    header: Header,
    twist: TwistWithCovariance,
}

impl RosMessage for Twist {
    type Message = TwistStamped;

    fn to_ros(message: &Stamped<Self>) -> TwistStamped {
        TwistStamped { header: Header::of(message), twist: TwistWithCovariance::of(message) }
    }

    fn from_ros(message: TwistStamped) -> Result<(Self, WallTime), DecodeError> {
        Ok((message.twist.twist(), message.header.stamp.wall_time()))
    }
}
