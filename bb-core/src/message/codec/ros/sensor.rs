//! `sensor_msgs`

use super::{Header, RosMessage, covariance};
use crate::Payload;
use crate::message::{DecodeError, Stamped};
use crate::payload::{Imu, JointState, MagneticField};
use crate::time::WallTime;
use nalgebra::{UnitQuaternion, Vector3};

/// `sensor_msgs/msg/Imu`
#[derive(Clone, Debug, Payload)]
#[payload(name = "sensor_msgs/Imu")]
pub struct ImuMessage {
    header: Header,
    orientation: UnitQuaternion<f64>,
    orientation_covariance: [f64; 9],
    angular_velocity: Vector3<f64>,
    angular_velocity_covariance: [f64; 9],
    linear_acceleration: Vector3<f64>,
    linear_acceleration_covariance: [f64; 9],
}

/// The first element of the covariance of an orientation that is not there.
const ABSENT: f64 = -1.0;

impl RosMessage for Imu {
    type Message = ImuMessage;

    fn to_ros(message: &Stamped<Self>) -> ImuMessage {
        let mut orientation_covariance: [f64; 9] = covariance::to_ros(&message.orientation_covariance);
        if message.orientation.is_none() {
            orientation_covariance = [ABSENT, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        }
        ImuMessage {
            header: Header::of(message),
            orientation: message.orientation.unwrap_or_else(UnitQuaternion::identity),
            orientation_covariance,
            angular_velocity: message.angular_velocity,
            angular_velocity_covariance: covariance::to_ros(&message.angular_velocity_covariance),
            linear_acceleration: message.linear_acceleration,
            linear_acceleration_covariance: covariance::to_ros(&message.linear_acceleration_covariance),
        }
    }

    fn from_ros(message: ImuMessage) -> Result<(Self, WallTime), DecodeError> {
        let is_absent = message.orientation_covariance[0] == ABSENT;
        let imu = Self {
            angular_velocity: message.angular_velocity,
            linear_acceleration: message.linear_acceleration,
            orientation: (!is_absent).then_some(message.orientation),
            orientation_covariance: match is_absent {
                true => None,
                false => covariance::from_ros(&message.orientation_covariance),
            },
            angular_velocity_covariance: covariance::from_ros(&message.angular_velocity_covariance),
            linear_acceleration_covariance: covariance::from_ros(&message.linear_acceleration_covariance),
        };
        Ok((imu, message.header.stamp.wall_time()))
    }
}

/// `sensor_msgs/msg/MagneticField`
#[derive(Clone, Debug, Payload)]
#[payload(name = "sensor_msgs/MagneticField")]
pub struct MagneticFieldMessage {
    header: Header,
    magnetic_field: Vector3<f64>,
    magnetic_field_covariance: [f64; 9],
}

impl RosMessage for MagneticField {
    type Message = MagneticFieldMessage;

    fn to_ros(message: &Stamped<Self>) -> MagneticFieldMessage {
        MagneticFieldMessage {
            header: Header::of(message),
            magnetic_field: message.magnetic_field,
            magnetic_field_covariance: covariance::to_ros(&message.covariance),
        }
    }

    fn from_ros(message: MagneticFieldMessage) -> Result<(Self, WallTime), DecodeError> {
        let covariance = covariance::from_ros(&message.magnetic_field_covariance);
        Ok((Self { magnetic_field: message.magnetic_field, covariance }, message.header.stamp.wall_time()))
    }
}

/// `sensor_msgs/msg/JointState`
#[derive(Clone, Debug, Payload)]
#[payload(name = "sensor_msgs/JointState")]
pub struct JointStateMessage {
    header: Header,
    name: Vec<String>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    effort: Vec<f64>,
}

/// A list of one joint, which the frame names.
impl RosMessage for JointState {
    type Message = JointStateMessage;

    fn to_ros(message: &Stamped<Self>) -> JointStateMessage {
        JointStateMessage {
            header: Header::of(message),
            name: vec![message.frame.name().to_owned()],
            position: vec![message.position],
            velocity: message.velocity.into_iter().collect(),
            effort: message.effort.into_iter().collect(),
        }
    }

    fn from_ros(message: JointStateMessage) -> Result<(Self, WallTime), DecodeError> {
        let JointStateMessage { header, name, position, velocity, effort } = message;
        match (name.as_slice(), position.as_slice(), velocity.as_slice(), effort.as_slice()) {
            ([_], [position], [] | [_], [] | [_]) => {
                let (velocity, effort) = (velocity.first().copied(), effort.first().copied());
                Ok((Self { position: *position, velocity, effort }, header.stamp.wall_time()))
            }
            _ => {
                Err(DecodeError::new(0, "the state of one joint", format!("that of {}", name.len())).within("name"))
            }
        }
    }
}
