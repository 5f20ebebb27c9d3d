//! Common payloads of robots; they mirror ROS messages where these exist. All in SI units.
//!
//! | what | payloads |
//! |---|---|
//! | inertial and magnetic sensors, pressure | [`Imu`], [`MagneticField`], [`Marg`], [`FluidPressure`] |
//! | distance | [`Range`], [`LaserScan`] |
//! | navigation satellites | [`GnssFix`] |
//! | images | [`Image`] |
//! | power | [`BatteryState`], [`PowerState`] |
//! | position and orientation | [`Orientation`], [`Pose`], [`PoseWithCovariance`], [`RelativePose`], [`Path`] |
//! | motion and forces | [`Twist`], [`TwistWithCovariance`], [`Accel`], [`Wrench`] |
//! | pose with motion | [`Odometry`] |
//! | joints | [`JointState`], [`JointStates`], [`MotorState`], [`JointSnapshot`] |
//! | commands to actuators, and their reports | [`ActuatorCommand`], [`PositionCommand`], [`VelocityCommand`], [`EffortCommand`], [`JointTrajectory`], [`BeginMotion`], [`EndMotion`] |

mod actuator;
mod attitude;
mod geometry;
mod gnss;
mod image;
mod joint;
mod odometry;
mod path;
mod power;
mod range;
mod ros;
mod sensor;
mod trajectory;

pub use actuator::{
    ActuatorCommand, BeginMotion, EffortCommand, EndMotion, MotionEnd, PositionCommand, VelocityCommand,
};
pub use attitude::{Orientation, Pose};
pub use geometry::{Accel, PoseWithCovariance, TwistWithCovariance, Wrench};
pub use gnss::{GeodeticPosition, GnssFix, GnssServices, GnssStatus};
pub use image::Image;
pub use joint::{JointSnapshot, JointState, JointStates, MotorState};
pub use odometry::{Odometry, Twist};
pub use path::{Path, PathPose, RelativePose};
pub use power::{BatteryHealth, BatteryState, BatteryStatus, BatteryTechnology, PowerState};
pub use range::{LaserScan, Radiation, Range};
pub use sensor::{FluidPressure, Imu, MagneticField, Marg};
pub use trajectory::{JointTrajectory, TrajectoryPoint};
