//! Motion: twist, and pose with twist.

use super::Pose;
use crate::message::Payload;
use nalgebra::{Matrix6, Vector3};

/// The velocity of a body, in its own frame (`geometry_msgs/TwistWithCovariance`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Twist {
    /// Velocity of the body's origin, in the body's frame, m/s.
    #[payload(unit = "m/s")]
    pub linear: Vector3<f64>,
    /// Angular velocity, in the body's frame, rad/s.
    #[payload(unit = "rad/s")]
    pub angular: Vector3<f64>,
    /// Covariance: linear (m²/s²), then angular (rad²/s²).
    pub covariance: Option<Matrix6<f64>>,
}

/// The pose and velocity of a body, from an estimator or from wheels (`nav_msgs/Odometry`). Either covariance may be
/// unknown.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Odometry {
    /// The pose in the world.
    pub pose: Pose,
    /// The motion in the body's frame.
    pub twist: Twist,
}
