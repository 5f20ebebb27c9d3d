//! Poses and twists whose covariance is known, accelerations, and forces.

use super::{Pose, Twist};
use crate::message::Payload;
use nalgebra::{Matrix6, UnitQuaternion, Vector3};

/// A [`Pose`] whose covariance is known (`geometry_msgs/PoseWithCovariance`), for viewers that draw it.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct PoseWithCovariance {
    /// The body's origin in the world, m.
    #[payload(unit = "m")]
    pub position: Vector3<f64>,
    /// Rotates vectors of the body to the world.
    pub world_from_body: UnitQuaternion<f64>,
    /// Covariance of position (m²) and of orientation as a small rotation (rad²), both about the axes of the world,
    /// as in ROS.
    pub covariance: Matrix6<f64>,
}

impl PoseWithCovariance {
    /// A pose, if its covariance is known.
    pub fn of(pose: &Pose) -> Option<Self> {
        let Pose { position, world_from_body, covariance } = *pose;
        covariance.map(|covariance| Self { position, world_from_body, covariance })
    }
}

impl From<PoseWithCovariance> for Pose {
    fn from(pose: PoseWithCovariance) -> Self {
        let PoseWithCovariance { position, world_from_body, covariance } = pose;
        Self { position, world_from_body, covariance: Some(covariance) }
    }
}

/// A [`Twist`] whose covariance is known (`geometry_msgs/TwistWithCovariance`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct TwistWithCovariance {
    /// Velocity of the body's origin, in the body's frame, m/s.
    #[payload(unit = "m/s")]
    pub linear: Vector3<f64>,
    /// Angular velocity, in the body's frame, rad/s.
    #[payload(unit = "rad/s")]
    pub angular: Vector3<f64>,
    /// Covariance: linear (m²/s²), then angular (rad²/s²).
    pub covariance: Matrix6<f64>,
}

impl TwistWithCovariance {
    /// A twist, if its covariance is known.
    pub fn of(twist: &Twist) -> Option<Self> {
        let Twist { linear, angular, covariance } = *twist;
        covariance.map(|covariance| Self { linear, angular, covariance })
    }
}

impl From<TwistWithCovariance> for Twist {
    fn from(twist: TwistWithCovariance) -> Self {
        let TwistWithCovariance { linear, angular, covariance } = twist;
        Self { linear, angular, covariance: Some(covariance) }
    }
}

/// The acceleration of a body, in its own frame (`geometry_msgs/AccelWithCovariance`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Accel {
    /// Acceleration of the body's origin, without gravity, m/s².
    #[payload(unit = "m/s^2")]
    pub linear: Vector3<f64>,
    /// Angular acceleration, rad/s².
    #[payload(unit = "rad/s^2")]
    pub angular: Vector3<f64>,
    /// Covariance: linear (m²/s⁴), then angular (rad²/s⁴).
    pub covariance: Option<Matrix6<f64>>,
}

/// Force and torque on a body, in the message's frame (`geometry_msgs/Wrench`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Wrench {
    /// Force, N.
    #[payload(unit = "N")]
    pub force: Vector3<f64>,
    /// Torque about the frame's origin, N·m.
    #[payload(unit = "N*m")]
    pub torque: Vector3<f64>,
}
