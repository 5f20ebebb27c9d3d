//! `geometry_msgs`

use super::{WORLD, covariance};
use crate::Payload;
use crate::message::codec::{Field, FieldShape, Reader, Shape, StructShape, Writer};
use crate::message::{DecodeError, Finite};
use crate::payload::{Orientation, Pose, Twist};
use nalgebra::{UnitQuaternion, Vector3};

/// `geometry_msgs/Point`
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
    fn write(&self, writer: &mut Writer<'_>) {
        self.0.write(writer);
    }
    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Vector3::read(reader).map(Self)
    }
}

/// `geometry_msgs/Pose`
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

/// `geometry_msgs/PoseWithCovariance`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/PoseWithCovariance")]
pub(super) struct PoseWithCovarianceMessage {
    pose: PoseMessage,
    covariance: [f64; 36],
}

impl PoseWithCovarianceMessage {
    pub(super) fn of(pose: &Pose) -> Self {
        Self { pose: PoseMessage::of(pose), covariance: covariance::to_ros(&pose.covariance) }
    }

    pub(super) fn pose(&self) -> Pose {
        Pose { covariance: covariance::from_ros(&self.covariance), ..self.pose.pose() }
    }
}

/// `geometry_msgs/Twist`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/Twist")]
struct TwistMessage {
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

/// `geometry_msgs/TwistWithCovariance`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/TwistWithCovariance")]
pub(super) struct TwistWithCovarianceMessage {
    twist: TwistMessage,
    covariance: [f64; 36],
}

impl TwistWithCovarianceMessage {
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

ros_message! {
    Orientation => QuaternionStamped "geometry_msgs/QuaternionStamped" in WORLD;
    write(orientation) { quaternion: UnitQuaternion<f64> = orientation.world_from_body, }
    read { Self::new(quaternion) }
}

ros_message! {
    Pose => PoseStamped "geometry_msgs/PoseStamped" in WORLD;
    write(it) { pose: PoseMessage = PoseMessage::of(it), }
    read { pose.pose() }
}

ros_message! {
    Twist => TwistStamped "geometry_msgs/TwistWithCovarianceStamped";
    write(it) { twist: TwistWithCovarianceMessage = TwistWithCovarianceMessage::of(it), }
    read { twist.twist() }
}
