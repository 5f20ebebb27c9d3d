//! The ROS 2 messages that are read, field by field as their definitions have them.
//!
//! Units and frames are those of REP 103 and of the definitions: metres, seconds, radians, tesla; a header's
//! `frame_id` names the frame of the values. Covariances are row-major; the convention of ROS is that all zeros
//! mean unknown and a first element of −1 means that the quantity is absent.

use serde::{Deserialize, Serialize};

use crate::cdr;

/// A message of one of the types that are read.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum RosMessage {
    /// `sensor_msgs/msg/Imu`
    Imu(Imu),
    /// `sensor_msgs/msg/MagneticField`
    MagneticField(MagneticField),
    /// `sensor_msgs/msg/NavSatFix`
    NavSatFix(NavSatFix),
    /// `sensor_msgs/msg/JointState`
    JointState(JointState),
    /// `geometry_msgs/msg/PoseStamped`
    PoseStamped(PoseStamped),
    /// `nav_msgs/msg/Odometry`, boxed since its two covariances would make every message as large.
    Odometry(Box<Odometry>),
    /// `std_msgs/msg/Bool`
    Bool(Bool),
}

impl RosMessage {
    /// The message's header, with the time and the frame of its values; `Bool` has none.
    pub fn header(&self) -> Option<&Header> {
        match self {
            Self::Imu(m) => Some(&m.header),
            Self::MagneticField(m) => Some(&m.header),
            Self::NavSatFix(m) => Some(&m.header),
            Self::JointState(m) => Some(&m.header),
            Self::PoseStamped(m) => Some(&m.header),
            Self::Odometry(m) => Some(&m.header),
            Self::Bool(_) => None,
        }
    }
}

/// Reads one payload as the type it stands for; the error says what is wrong with the bytes.
pub(crate) type Decode = fn(&[u8]) -> Result<RosMessage, String>;

/// Every type that is read, by its full name.
const TYPES: &[(&str, Decode)] = &[
    ("sensor_msgs/msg/Imu", |bytes| cdr::decode(bytes).map(RosMessage::Imu)),
    ("sensor_msgs/msg/MagneticField", |bytes| cdr::decode(bytes).map(RosMessage::MagneticField)),
    ("sensor_msgs/msg/NavSatFix", |bytes| cdr::decode(bytes).map(RosMessage::NavSatFix)),
    ("sensor_msgs/msg/JointState", |bytes| cdr::decode(bytes).map(RosMessage::JointState)),
    ("geometry_msgs/msg/PoseStamped", |bytes| cdr::decode(bytes).map(RosMessage::PoseStamped)),
    ("nav_msgs/msg/Odometry", |bytes| cdr::decode(bytes).map(Box::new).map(RosMessage::Odometry)),
    ("std_msgs/msg/Bool", |bytes| cdr::decode(bytes).map(RosMessage::Bool)),
];

/// How to read payloads of the type with this full name, if it is one of those that are read.
pub(crate) fn decoder(schema: &str) -> Option<Decode> {
    TYPES.iter().find(|(name, _)| *name == schema).map(|(_, decode)| *decode)
}

/// The full names of the types that are read.
pub(crate) fn known() -> Vec<&'static str> {
    TYPES.iter().map(|(name, _)| *name).collect()
}

/// The full spelling of a type's name: some writers say `sensor_msgs/Imu` for `sensor_msgs/msg/Imu`.
pub(crate) fn full_name(schema: &str) -> String {
    match schema.split_once('/') {
        Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
        _ => schema.to_owned(),
    }
}

/// `builtin_interfaces/msg/Time`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub struct Stamp {
    /// Whole seconds of the sender's clock, mostly since 1970.
    pub sec: i32,
    /// Nanoseconds on top of them.
    pub nanosec: u32,
}

impl Stamp {
    /// The stamp in nanoseconds, which no stamp overflows.
    pub fn nanoseconds(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

/// `std_msgs/msg/Header`
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Header {
    /// When the values held, by the sender's clock; not when they were recorded.
    pub stamp: Stamp,
    /// The frame of the values.
    pub frame_id: String,
}

/// `geometry_msgs/msg/Vector3`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Vector3 {
    /// Along the first axis.
    pub x: f64,
    /// Along the second axis.
    pub y: f64,
    /// Along the third axis.
    pub z: f64,
}

/// `geometry_msgs/msg/Point`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Point {
    /// Along the first axis, metres.
    pub x: f64,
    /// Along the second axis, metres.
    pub y: f64,
    /// Along the third axis, metres.
    pub z: f64,
}

/// `geometry_msgs/msg/Quaternion`, vector part first. Nothing makes it a unit quaternion: absent orientations
/// are often all zeros, lost ones NaN.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// First component of the vector part.
    pub x: f64,
    /// Second component of the vector part.
    pub y: f64,
    /// Third component of the vector part.
    pub z: f64,
    /// The scalar part.
    pub w: f64,
}

impl Default for Quaternion {
    /// The identity, as in the definition.
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// `geometry_msgs/msg/Pose`: from the body to the frame of the header.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Pose {
    /// Where the body is, metres.
    pub position: Point,
    /// How it is turned.
    pub orientation: Quaternion,
}

/// `geometry_msgs/msg/PoseStamped`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PoseStamped {
    /// Time and frame.
    pub header: Header,
    /// The pose in that frame.
    pub pose: Pose,
}

/// `geometry_msgs/msg/PoseWithCovariance`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// Of x, y, z (metres) and the rotation about the fixed X, Y, Z axes (radians), row by row. The definition's
    /// flat array of 36 has the same bytes.
    pub covariance: [[f64; 6]; 6],
}

/// `geometry_msgs/msg/Twist`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Twist {
    /// Velocity, m/s.
    pub linear: Vector3,
    /// Rotation rate, rad/s.
    pub angular: Vector3,
}

/// `geometry_msgs/msg/TwistWithCovariance`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The velocities.
    pub twist: Twist,
    /// Of the linear (m/s), then the angular velocity (rad/s), row by row.
    pub covariance: [[f64; 6]; 6],
}

/// `nav_msgs/msg/Odometry`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Odometry {
    /// Time and the frame of the pose.
    pub header: Header,
    /// The body's frame: the pose leads from it, the twist is given in it.
    pub child_frame_id: String,
    /// The pose of the body in the frame of the header.
    pub pose: PoseWithCovariance,
    /// The velocities in the body's frame.
    pub twist: TwistWithCovariance,
}

/// `sensor_msgs/msg/Imu`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Imu {
    /// Time and the sensor's frame.
    pub header: Header,
    /// The sensor's own estimate, where it makes one.
    pub orientation: Quaternion,
    /// About the x, y, z axes, rad²; a first element of −1 says that there is no orientation.
    pub orientation_covariance: [f64; 9],
    /// Rotation rate, rad/s.
    pub angular_velocity: Vector3,
    /// About the x, y, z axes, (rad/s)².
    pub angular_velocity_covariance: [f64; 9],
    /// Specific force, m/s²: upwards +g at rest.
    pub linear_acceleration: Vector3,
    /// Along the x, y, z axes, (m/s²)².
    pub linear_acceleration_covariance: [f64; 9],
}

/// `sensor_msgs/msg/MagneticField`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct MagneticField {
    /// Time and the sensor's frame.
    pub header: Header,
    /// The field, tesla; NaN where an axis is not measured.
    pub magnetic_field: Vector3,
    /// Along the x, y, z axes, tesla².
    pub magnetic_field_covariance: [f64; 9],
}

/// `sensor_msgs/msg/NavSatStatus`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct NavSatStatus {
    /// −2 unknown, −1 no fix, 0 fix, 1 with satellite-based, 2 with ground-based augmentation.
    pub status: i8,
    /// The systems used, as bits: 1 GPS, 2 GLONASS, 4 COMPASS (with BeiDou), 8 Galileo.
    pub service: u16,
}

/// `sensor_msgs/msg/NavSatFix`
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct NavSatFix {
    /// Time and the frame of the antenna.
    pub header: Header,
    /// Whether there is a fix.
    pub status: NavSatStatus,
    /// Degrees, north positive.
    pub latitude: f64,
    /// Degrees, east positive.
    pub longitude: f64,
    /// Metres above the WGS 84 ellipsoid; NaN if unknown.
    pub altitude: f64,
    /// East, north, up at the antenna, m².
    pub position_covariance: [f64; 9],
    /// 0 unknown, 1 approximated, 2 diagonal known, 3 known.
    pub position_covariance_type: u8,
}

/// `sensor_msgs/msg/JointState`. Each list is as long as `name`, or empty where the quantity is not given.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct JointState {
    /// Time; the frame says nothing here.
    pub header: Header,
    /// The joints.
    pub name: Vec<String>,
    /// rad, or metres for a joint that slides.
    pub position: Vec<f64>,
    /// rad/s or m/s.
    pub velocity: Vec<f64>,
    /// N m or N.
    pub effort: Vec<f64>,
}

/// `std_msgs/msg/Bool`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Bool {
    /// The value.
    pub data: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_spellings_of_a_type_are_one() {
        assert_eq!(full_name("sensor_msgs/Imu"), "sensor_msgs/msg/Imu");
        assert_eq!(full_name("sensor_msgs/msg/Imu"), "sensor_msgs/msg/Imu");
        assert_eq!(full_name("Imu"), "Imu");
        assert_eq!(full_name(""), "");
    }

    #[test]
    fn the_extreme_stamps_do_not_overflow() {
        let most = Stamp { sec: i32::MAX, nanosec: u32::MAX };
        assert_eq!(most.nanoseconds(), i64::from(i32::MAX) * 1_000_000_000 + i64::from(u32::MAX));
        let least = Stamp { sec: -1, nanosec: 999_999_999 };
        assert_eq!(least.nanoseconds(), -1);
        assert_eq!(Stamp { sec: i32::MIN, nanosec: 0 }.nanoseconds(), i64::from(i32::MIN) * 1_000_000_000);
    }

    #[test]
    fn every_type_has_its_decoder() {
        for name in known() {
            assert!(decoder(name).is_some_and(|decode| decode(&[]).is_err()), "{name}");
        }
        assert!(decoder("sensor_msgs/msg/LaserScan").is_none());
    }
}
