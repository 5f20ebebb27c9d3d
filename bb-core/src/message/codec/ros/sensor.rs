//! `sensor_msgs`

use super::covariance;
use crate::message::DecodeError;
use crate::payload::{Imu, JointState, MagneticField};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// The covariance of an orientation that is not measured: −1 first.
const NO_ORIENTATION: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

fn orientation_from_ros(
    orientation: UnitQuaternion<f64>,
    covariance: &[f64; 9],
) -> (Option<UnitQuaternion<f64>>, Option<Matrix3<f64>>) {
    match covariance[0] == NO_ORIENTATION[0] {
        true => (None, None),
        false => (Some(orientation), covariance::from_ros(covariance)),
    }
}

ros_message! {
    Imu => ImuMessage "sensor_msgs/Imu";
    write(imu) {
        orientation: UnitQuaternion<f64> = imu.orientation.unwrap_or_else(UnitQuaternion::identity),
        orientation_covariance: [f64; 9] = match imu.orientation {
            Some(_) => covariance::to_ros(&imu.orientation_covariance),
            None => NO_ORIENTATION,
        },
        angular_velocity: Vector3<f64> = imu.angular_velocity,
        angular_velocity_covariance: [f64; 9] = covariance::to_ros(&imu.angular_velocity_covariance),
        linear_acceleration: Vector3<f64> = imu.linear_acceleration,
        linear_acceleration_covariance: [f64; 9] = covariance::to_ros(&imu.linear_acceleration_covariance),
    }
    read {
        let (orientation, orientation_covariance) = orientation_from_ros(orientation, &orientation_covariance);
        Self {
            angular_velocity,
            linear_acceleration,
            orientation,
            orientation_covariance,
            angular_velocity_covariance: covariance::from_ros(&angular_velocity_covariance),
            linear_acceleration_covariance: covariance::from_ros(&linear_acceleration_covariance),
        }
    }
}

ros_message! {
    MagneticField => MagneticFieldMessage "sensor_msgs/MagneticField";
    write(field) {
        magnetic_field: Vector3<f64> = field.magnetic_field,
        magnetic_field_covariance: [f64; 9] = covariance::to_ros(&field.covariance),
    }
    read { Self { magnetic_field, covariance: covariance::from_ros(&magnetic_field_covariance) } }
}

// A list of one joint, which the frame names.
ros_message! {
    JointState => JointStateMessage "sensor_msgs/JointState";
    write(joint) {
        name: Vec<String> = vec![joint.frame.name().to_owned()],
        position: Vec<f64> = vec![joint.position],
        velocity: Vec<f64> = joint.velocity.into_iter().collect(),
        effort: Vec<f64> = joint.effort.into_iter().collect(),
    }
    read {
        match (name.as_slice(), position.as_slice(), velocity.as_slice(), effort.as_slice()) {
            ([_], [position], [] | [_], [] | [_]) => {
                Self { position: *position, velocity: velocity.first().copied(), effort: effort.first().copied() }
            }
            _ => {
                let found = format!("that of {}", name.len());
                return Err(DecodeError::new(0, "the state of one joint", found).within("name"));
            }
        }
    }
}
