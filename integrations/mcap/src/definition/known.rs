//! Types that can be read even if the file does not define them.

use bb_core::message::codec::ros::{Text, TransformStamped, TransformsMessage};
use bb_core::message::codec::{Field, Shape};
use bb_core::message::{Payload, Schema, Stamped};
use bb_core::payload::{
    Accel, BatteryState, FluidPressure, GnssFix, Image, Imu, JointState, JointTrajectory, LaserScan, MagneticField,
    Odometry, Orientation, Path, Pose, PoseWithCovariance, Range, TwistWithCovariance, Wrench,
};

/// ROS types that no payload is written as.
const PLAIN: [(&str, &str); 14] = [
    ("std_msgs/msg/Bool", "bool data"),
    ("std_msgs/msg/Int8", "int8 data"),
    ("std_msgs/msg/Int16", "int16 data"),
    ("std_msgs/msg/Int32", "int32 data"),
    ("std_msgs/msg/Int64", "int64 data"),
    ("std_msgs/msg/UInt8", "uint8 data"),
    ("std_msgs/msg/UInt16", "uint16 data"),
    ("std_msgs/msg/UInt32", "uint32 data"),
    ("std_msgs/msg/UInt64", "uint64 data"),
    ("std_msgs/msg/Float32", "float32 data"),
    ("std_msgs/msg/Float64", "float64 data"),
    ("std_msgs/msg/Empty", ""),
    ("geometry_msgs/msg/Vector3", VECTOR),
    (
        "geometry_msgs/msg/Twist",
        "Vector3 linear\nVector3 angular\n===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z",
    ),
];
const VECTOR: &str = "float64 x\nfloat64 y\nfloat64 z";

/// The text of the definition of a type in the full spelling.
pub(super) fn definition(name: &str) -> Option<String> {
    if let Some((_, text)) = PLAIN.iter().find(|(known, _)| *known == name) {
        return Some((*text).to_owned());
    }
    let known = SCHEMAS.iter().filter_map(|schema| schema());
    known.into_iter().find(|schema| schema.name == name).map(|schema| schema.text)
}

const SCHEMAS: [fn() -> Option<Schema>; 21] = [
    ros::<Imu>,
    ros::<MagneticField>,
    ros::<FluidPressure>,
    ros::<Range>,
    ros::<LaserScan>,
    ros::<Image>,
    ros::<GnssFix>,
    ros::<BatteryState>,
    ros::<JointState>,
    ros::<JointTrajectory>,
    ros::<Orientation>,
    ros::<Pose>,
    ros::<PoseWithCovariance>,
    ros::<TwistWithCovariance>,
    ros::<Accel>,
    ros::<Wrench>,
    ros::<Odometry>,
    ros::<Path>,
    plain::<Text>,
    plain::<TransformStamped>,
    plain::<TransformsMessage>,
];

fn ros<T: Payload>() -> Option<Schema> {
    Stamped::<T>::ros_schema()
}

fn plain<T: Field>() -> Option<Schema> {
    match T::SHAPE {
        Shape::Struct(shape) => Some(Schema::new(shape.name, T::SHAPE)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::MessageDefinition;
    use super::*;

    #[test]
    fn every_known_definition_is_one() {
        let schemas = SCHEMAS.iter().map(|schema| schema().expect("ROS has it").name);
        for name in schemas.chain(PLAIN.iter().map(|(name, _)| (*name).to_owned())) {
            let text = definition(&name).expect("it is known");
            MessageDefinition::parse(&name, &text).unwrap_or_else(|fault| panic!("{name}: {fault}"));
        }
    }
}
