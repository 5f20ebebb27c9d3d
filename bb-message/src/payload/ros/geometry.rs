//! `geometry_msgs`; covariances are six by six: linear part first, then angular.

use super::{WORLD, covariance, ros_message};
use crate::message::Payload;
use crate::message::codec::{Field, FieldShape, Reader, Shape, StructShape, Writer};
use crate::message::{DecodeError, Finite};
use crate::payload::{Accel, Orientation, Pose, PoseWithCovariance, Twist, TwistWithCovariance, Wrench};
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
    const IS_INLINE: bool = true;
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
    pub(super) fn of(position: Vector3<f64>, orientation: UnitQuaternion<f64>) -> Self {
        Self { position: Point(position), orientation }
    }

    pub(super) fn position(&self) -> Vector3<f64> {
        self.position.0
    }

    pub(super) fn orientation(&self) -> UnitQuaternion<f64> {
        self.orientation
    }

    fn pose(&self) -> Pose {
        Pose { position: self.position(), world_from_body: self.orientation(), covariance: None }
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
        let message = PoseMessage::of(pose.position, pose.world_from_body);
        Self { pose: message, covariance: covariance::to_ros(&pose.covariance) }
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
    write(it) { pose: PoseMessage = PoseMessage::of(it.position, it.world_from_body), }
    read { pose.pose() }
}

ros_message! {
    Twist => TwistStamped "geometry_msgs/TwistWithCovarianceStamped";
    write(it) { twist: TwistWithCovarianceMessage = TwistWithCovarianceMessage::of(it), }
    read { twist.twist() }
}

ros_message! {
    PoseWithCovariance => PoseWithCovarianceStamped "geometry_msgs/PoseWithCovarianceStamped" in WORLD;
    write(it) { pose: PoseWithCovarianceMessage = PoseWithCovarianceMessage::of(&it.payload.into()), }
    read {
        Self {
            position: pose.pose.position(),
            world_from_body: pose.pose.orientation(),
            covariance: covariance::matrix(&pose.covariance),
        }
    }
}

ros_message! {
    TwistWithCovariance => TwistStamped;
    write(it) { twist = TwistWithCovarianceMessage::of(&it.payload.into()), }
    read {
        let TwistMessage { linear, angular } = twist.twist;
        Self { linear, angular, covariance: covariance::matrix(&twist.covariance) }
    }
}

/// `geometry_msgs/Accel`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/Accel")]
struct AccelMessage {
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

/// `geometry_msgs/AccelWithCovariance`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/AccelWithCovariance")]
struct AccelWithCovariance {
    accel: AccelMessage,
    covariance: [f64; 36],
}

ros_message! {
    Accel => AccelStamped "geometry_msgs/AccelWithCovarianceStamped";
    write(it) {
        accel: AccelWithCovariance = AccelWithCovariance {
            accel: AccelMessage { linear: it.linear, angular: it.angular },
            covariance: covariance::to_ros(&it.covariance),
        },
    }
    read {
        let AccelMessage { linear, angular } = accel.accel;
        Self { linear, angular, covariance: covariance::from_ros(&accel.covariance) }
    }
}

/// `geometry_msgs/Wrench`
#[derive(Clone, Debug, Payload)]
#[payload(name = "geometry_msgs/Wrench")]
struct WrenchMessage {
    force: Vector3<f64>,
    torque: Vector3<f64>,
}

ros_message! {
    Wrench => WrenchStamped "geometry_msgs/WrenchStamped";
    write(it) { wrench: WrenchMessage = WrenchMessage { force: it.force, torque: it.torque }, }
    read { Self { force: wrench.force, torque: wrench.torque } }
}
