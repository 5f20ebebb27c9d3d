//! Messages in the layout that ROS has for them, so that viewers and other tools know them.
//!
//! | payload | message | not told apart |
//! |---|---|---|
//! | [`Imu`](crate::payload::Imu) | `sensor_msgs/msg/Imu` | an unknown covariance and one of zeros; a covariance of an orientation that is not there |
//! | [`MagneticField`](crate::payload::MagneticField) | `sensor_msgs/msg/MagneticField` | an unknown covariance and one of zeros |
//! | [`JointState`](crate::payload::JointState) | `sensor_msgs/msg/JointState` | – |
//! | [`Orientation`](crate::payload::Orientation) | `geometry_msgs/msg/QuaternionStamped` | the covariance is left out |
//! | [`Pose`](crate::payload::Pose) | `geometry_msgs/msg/PoseStamped` | the covariance is left out |
//! | [`Twist`](crate::payload::Twist) | `geometry_msgs/msg/TwistWithCovarianceStamped` | an unknown covariance and one of zeros |
//! | [`Odometry`](crate::payload::Odometry) | `nav_msgs/msg/Odometry` | an unknown covariance and one of zeros |
//!
//! As in ROS, an unknown covariance is all zeros, and an orientation that is not there has −1 as the first element of its
//! covariance. A header's stamp has 32 bits for the seconds; times before 1901 and after 2038 do not fit. Whether a
//! message is told apart is asked by [`is_exact_as_ros`](super::is_exact_as_ros); one that is not needs the exact layout
//! as well. What a body's pose is given in is the frame [`WORLD`], not the body's.

mod covariance;
mod geometry;
mod odometry;
mod sensor;
mod standard;

pub use standard::{Header, Text, Time, TransformStamped, TransformsMessage};

use super::{DecodeError, Field, Reader, Shape, Writer};
use crate::message::{Payload, Stamped};
use crate::time::WallTime;

/// The frame that poses and orientations are given in: east, north, up.
pub const WORLD: &str = "world";

/// A payload that ROS has a message for. Name it at the derive, `#[payload(ros)]`, for it to be recorded that way.
///
/// The message is a struct of fields in ROS's order, with ROS's name:
///
/// ```
/// use bb_core::message::{DecodeError, RosMessage, Stamped, codec::ros::Header};
/// use bb_core::prelude::*;
///
/// /// Temperature of a motor's winding.
/// #[derive(Clone, Debug, Payload)]
/// #[payload(ros)]
/// pub struct WindingTemperature {
///     /// Kelvin.
///     pub temperature_k: f64,
/// }
///
/// #[derive(Clone, Debug, Payload)]
/// #[payload(name = "sensor_msgs/Temperature")]
/// pub struct TemperatureMessage {
///     header: Header,
///     temperature: f64, // degrees Celsius
///     variance: f64,
/// }
///
/// impl RosMessage for WindingTemperature {
///     type Message = TemperatureMessage;
///
///     fn to_ros(message: &Stamped<Self>) -> TemperatureMessage {
///         let header = Header::of(message);
///         TemperatureMessage { header, temperature: message.temperature_k - 273.15, variance: 0.0 }
///     }
///
///     fn from_ros(message: TemperatureMessage) -> Result<(Self, WallTime), DecodeError> {
///         Ok((Self { temperature_k: message.temperature + 273.15 }, message.header.stamp.wall_time()))
///     }
/// }
/// ```
pub trait RosMessage: Sized {
    /// The message, with its header.
    type Message: Field;

    /// The message as ROS has it.
    fn to_ros(message: &Stamped<Self>) -> Self::Message;

    /// Its payload and time.
    ///
    /// # Errors
    /// It is none that [`to_ros`](Self::to_ros) makes.
    fn from_ros(message: Self::Message) -> Result<(Self, WallTime), DecodeError>;
}

/// How messages of a payload are written in ROS's layout.
#[derive(Debug)]
pub struct RosLayout<T> {
    /// What the bytes mean.
    pub(crate) shape: Shape,
    pub(crate) write: fn(&Stamped<T>, &mut Writer<'_>),
    pub(crate) read: fn(&mut Reader<'_>) -> Result<(T, WallTime), DecodeError>,
}

impl<T: Payload + RosMessage> RosLayout<T> {
    /// As its [`RosMessage`] says.
    pub const OF: Self = Self {
        shape: <T::Message as Field>::SHAPE,
        write: |message, writer| T::to_ros(message).write(writer),
        read: |reader| T::from_ros(T::Message::read(reader)?),
    };

    /// As its [`RosMessage`] says.
    #[doc(hidden)]
    pub const fn of() -> Self {
        Self::OF
    }
}
