//! Messages of ROS 2, field by field as their definitions have them, written by another encoder than the project's own.

use serde::Serialize;

/// `builtin_interfaces/msg/Time`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Header {
    /// Time of the values, by the sender's clock; not that of recording.
    pub stamp: Stamp,
    /// The frame of the values.
    pub frame_id: String,
}

/// `geometry_msgs/msg/Vector3`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Vector3 {
    /// Along the first axis.
    pub x: f64,
    /// Along the second axis.
    pub y: f64,
    /// Along the third axis.
    pub z: f64,
}

/// `geometry_msgs/msg/Point`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Pose {
    /// Position of the body, metres.
    pub position: Point,
    /// Orientation of the body.
    pub orientation: Quaternion,
}

/// `geometry_msgs/msg/PoseStamped`
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PoseStamped {
    /// Time and frame.
    pub header: Header,
    /// The pose in that frame.
    pub pose: Pose,
}

/// `geometry_msgs/msg/PoseWithCovariance`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// Covariance of x, y, z (metres) and the rotation about the fixed X, Y, Z axes (radians), row by row. The
    /// definition's flat array of 36 has the same bytes.
    pub covariance: [[f64; 6]; 6],
}

/// `geometry_msgs/msg/Twist`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Twist {
    /// Velocity, m/s.
    pub linear: Vector3,
    /// Rotation rate, rad/s.
    pub angular: Vector3,
}

/// `geometry_msgs/msg/TwistWithCovariance`
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct TwistWithCovariance {
    /// The velocities.
    pub twist: Twist,
    /// Covariance of the linear (m/s), then the angular velocity (rad/s), row by row.
    pub covariance: [[f64; 6]; 6],
}

/// `nav_msgs/msg/Odometry`
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct MagneticField {
    /// Time and the sensor's frame.
    pub header: Header,
    /// The field, tesla; NaN where an axis is not measured.
    pub magnetic_field: Vector3,
    /// Along the x, y, z axes, tesla².
    pub magnetic_field_covariance: [f64; 9],
}

/// `sensor_msgs/msg/NavSatStatus`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct NavSatStatus {
    /// −2 unknown, −1 no fix, 0 fix, 1 with satellite-based, 2 with ground-based augmentation.
    pub status: i8,
    /// The systems used, as bits: 1 GPS, 2 GLONASS, 4 COMPASS (with BeiDou), 8 Galileo.
    pub service: u16,
}

/// `sensor_msgs/msg/NavSatFix`
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct NavSatFix {
    /// Time and the frame of the antenna.
    pub header: Header,
    /// State of the fix.
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
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Bool {
    /// The value.
    pub data: bool,
}
