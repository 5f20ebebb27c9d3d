//! The payloads that robots share; they mirror ROS where ROS has one. All SI.

mod attitude;
mod joint;
mod odometry;
mod sensor;

pub use attitude::{Orientation, Pose};
pub use joint::JointState;
pub use odometry::{Odometry, Twist};
pub use sensor::{Imu, MagneticField, Marg};
