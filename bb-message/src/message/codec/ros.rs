//! Messages in their ROS layout, so that viewers and other tools understand them. The payloads are those of
//! [`payload`](crate::payload), which implements the conversions.
//!
//! | payload | message | what it does not keep |
//! |---|---|---|
//! | `Imu` | `sensor_msgs/msg/Imu` | a covariance of zeros, which reads as unknown; that of an orientation that is not there |
//! | `Marg` | `sensor_msgs/msg/Imu`, and for the field a `sensor_msgs/msg/MagneticField` with the same header | as for those |
//! | `MagneticField` | `sensor_msgs/msg/MagneticField` | a covariance of zeros, which reads as unknown |
//! | `FluidPressure` | `sensor_msgs/msg/FluidPressure` | a variance of zero, which reads as unknown |
//! | `Range` | `sensor_msgs/msg/Range` | a variance of zero, which reads as unknown |
//! | `LaserScan` | `sensor_msgs/msg/LaserScan` | – |
//! | `Image` | `sensor_msgs/msg/Image` | – |
//! | `GnssFix` | `sensor_msgs/msg/NavSatFix` | the last bit of an angle, since ROS has degrees |
//! | `BatteryState` | `sensor_msgs/msg/BatteryState` | digits beyond the seventh, since ROS has `float32` |
//! | `JointState`, `JointStates`, `PositionCommand`, `VelocityCommand`, `EffortCommand` | `sensor_msgs/msg/JointState` | – |
//! | `JointTrajectory` | `trajectory_msgs/msg/JointTrajectory` | times beyond 68 years |
//! | `Orientation` | `geometry_msgs/msg/QuaternionStamped` | the covariance |
//! | `Pose` | `geometry_msgs/msg/PoseStamped` | the covariance |
//! | `PoseWithCovariance` | `geometry_msgs/msg/PoseWithCovarianceStamped` | – |
//! | `Twist` | `geometry_msgs/msg/TwistWithCovarianceStamped` | a covariance of zeros, which reads as unknown |
//! | `TwistWithCovariance` | `geometry_msgs/msg/TwistWithCovarianceStamped` | – |
//! | `Accel` | `geometry_msgs/msg/AccelWithCovarianceStamped` | a covariance of zeros, which reads as unknown |
//! | `Wrench` | `geometry_msgs/msg/WrenchStamped` | – |
//! | `Odometry` | `nav_msgs/msg/Odometry` | a covariance of zeros, which reads as unknown |
//! | `Path` | `nav_msgs/msg/Path` | – |
//!
//! As in ROS, an unknown covariance is all zeros, and an absent orientation has −1 as the first element of its
//! covariance. Values that a receiver or a battery does not measure are NaN. A header's stamp has 32 bits for the
//! seconds; times before 1901 and after 2038 do not fit. [`is_exact_as_ros`](super::is_exact_as_ros) tells whether a
//! message reads back unchanged; one that does not needs the exact layout as well. Poses are given in the frame
//! [`WORLD`], not the body's.

/// Declares a ROS message with a header, and the conversions between it and a payload.
///
/// The expressions of `write` see the `Stamped` payload by the name in parentheses; those of `read` see the message's
/// fields by their names and may return a `DecodeError` with `?`. The header has the message's frame, or that of
/// `in`. Without types, the message is one that is already declared.
///
/// ```text
/// ros_message! {
///     FluidPressure => FluidPressureMessage "sensor_msgs/FluidPressure";
///     write(pressure) {
///         fluid_pressure: f64 = pressure.fluid_pressure,
///         variance: f64 = pressure.variance.unwrap_or_default(),
///     }
///     read { Self { fluid_pressure, variance: unless_zero(variance) } }
/// }
/// ```
macro_rules! ros_message {
    (
        $payload:ty => $name:ident $ros:literal $(in $frame:expr)?;
        write($message:ident) { $($field:ident: $kind:ty = $value:expr,)* }
        read $read:block
    ) => {
        #[doc = concat!("`", $ros, "`")]
        #[derive(Clone, Debug, crate::message::Payload)]
        #[payload(name = $ros)]
        pub struct $name {
            header: crate::message::codec::ros::Header,
            $($field: $kind,)*
        }

        ros_message! {
            $payload => $name $(in $frame)?;
            write($message) { $($field = $value,)* }
            read $read
        }
    };
    (
        $payload:ty => $name:ident $(in $frame:expr)?;
        write($message:ident) { $($field:ident = $value:expr,)* }
        read $read:block
    ) => {
        impl crate::message::RosMessage for $payload {
            type Message = $name;

            fn to_ros($message: &crate::message::Stamped<Self>) -> $name {
                let frame = ros_message!(@frame $message $($frame)?);
                $name { header: crate::message::codec::ros::Header::in_frame($message, frame), $($field: $value,)* }
            }

            fn from_ros(
                message: $name,
            ) -> Result<(Self, crate::time::WallTime), crate::message::DecodeError> {
                let $name { header, $($field,)* } = message;
                Ok(($read, header.stamp.wall_time()))
            }
        }
    };
    (@frame $message:ident) => {
        $message.frame.name()
    };
    (@frame $message:ident $frame:expr) => {
        $frame
    };
}

mod standard;
#[cfg(test)]
mod tests;

pub(crate) use ros_message;
pub(crate) use standard::DurationMessage;
pub(in crate::message::codec) use standard::ServiceEventInfo;

pub use standard::{Byte, Header, Text, Time, TransformStamped, TransformsMessage};

use super::{DecodeError, Field, Reader, Shape, Writer};
use crate::message::{Payload, Stamped};
use crate::time::WallTime;

/// The frame that poses and orientations are given in: east, north, up.
pub const WORLD: &str = "world";

/// A payload with a ROS message. State it at the derive, `#[payload(ros)]`, to record the payload that way.
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

    /// A second message, if ROS splits the payload into two.
    const COMPANION: Option<RosCompanion<Self>> = None;

    /// Converts a message to ROS's.
    fn to_ros(message: &Stamped<Self>) -> Self::Message;

    /// Converts it back to a payload and a time.
    ///
    /// # Errors
    /// The message is not one that [`to_ros`](Self::to_ros) produces.
    fn from_ros(message: Self::Message) -> Result<(Self, WallTime), DecodeError>;
}

/// A second ROS message for a payload, recorded on a topic below that of the first. Each payload may have it or not.
#[derive(Debug)]
pub struct RosCompanion<T> {
    /// The last part of the topic: `magnetic_field`.
    pub topic: &'static str,
    /// The layout of the bytes.
    pub shape: Shape,
    /// Appends it, or appends nothing and returns false if this payload does not have it.
    pub write: fn(&Stamped<T>, &mut Writer<'_>) -> bool,
    /// Adds its contents to the payload that was read from the first message.
    pub read: fn(&mut T, &mut Reader<'_>) -> Result<(), DecodeError>,
}

/// Writes messages of a payload in ROS's layout, and reads them.
#[derive(Debug)]
pub struct RosLayout<T> {
    /// The layout of the bytes.
    pub(crate) shape: Shape,
    pub(crate) write: fn(&Stamped<T>, &mut Writer<'_>),
    pub(crate) read: fn(&mut Reader<'_>) -> Result<(T, WallTime), DecodeError>,
    pub(super) is_exact: fn(&Stamped<T>) -> bool,
    pub(crate) companion: Option<RosCompanion<T>>,
}

impl<T: Payload + RosMessage> RosLayout<T> {
    /// Layout given by the payload's [`RosMessage`] implementation.
    pub const OF: Self = Self {
        shape: <T::Message as Field>::SHAPE,
        write: |message, writer| T::to_ros(message).write(writer),
        read: |reader| T::from_ros(T::Message::read(reader)?),
        is_exact: reads_back,
        companion: T::COMPANION,
    };

    /// Returns the layout given by the payload's [`RosMessage`] implementation.
    #[doc(hidden)]
    pub const fn of() -> Self {
        Self::OF
    }
}

/// Returns whether payload and wall time of a message are the same bit for bit after ROS's layout, with its second message if there is one.
fn reads_back<T: Payload + RosMessage>(message: &Stamped<T>) -> bool {
    let mut bytes = Vec::new();
    T::to_ros(message).write(&mut Writer::new(&mut bytes));
    let read = T::Message::read(&mut Reader::new(&bytes)).and_then(T::from_ros);
    let Ok((mut payload, wall_time)) = read else { return false };
    if let Some(companion) = T::COMPANION {
        bytes.clear();
        if (companion.write)(message, &mut Writer::new(&mut bytes))
            && (companion.read)(&mut payload, &mut Reader::new(&bytes)).is_err()
        {
            return false;
        }
    }
    let (mut read, mut written) = (Vec::new(), Vec::new());
    payload.write(&mut Writer::new(&mut read));
    message.payload.write(&mut Writer::new(&mut written));
    wall_time == message.wall_time && read == written
}

impl<T> RosLayout<T> {
    /// The layout of the bytes.
    pub fn shape(&self) -> Shape {
        self.shape
    }
}
