//! Orientation and pose of a body.

use crate::message::Payload;
use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};

/// The orientation of a body in the world.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Orientation {
    /// Rotates vectors of the body to the world (east, north, up).
    pub world_from_body: UnitQuaternion<f64>,
    /// Covariance of the error as a small rotation of the body, rad².
    pub covariance: Option<Matrix3<f64>>,
}

impl Orientation {
    /// An orientation, its covariance unknown.
    pub fn new(world_from_body: UnitQuaternion<f64>) -> Self {
        Self { world_from_body, covariance: None }
    }
}

/// The position and orientation of a body in the world (`geometry_msgs/PoseWithCovariance`).
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
#[payload(ros)]
pub struct Pose {
    /// The body's origin in the world, m.
    #[payload(unit = "m")]
    pub position: Vector3<f64>,
    /// Rotates vectors of the body to the world.
    pub world_from_body: UnitQuaternion<f64>,
    /// Covariance of position (m²) and of orientation as a small rotation (rad²), both about the axes of the world,
    /// as in ROS.
    pub covariance: Option<Matrix6<f64>>,
}
