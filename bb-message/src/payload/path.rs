//! Poses along a path, and relative poses.

use crate::message::Payload;
use crate::time::{MonotonicTime, WallTime};
use nalgebra::{Matrix6, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Poses in order, in the world: the past or planned path of a body (`nav_msgs/Path`).
#[derive(Clone, Debug, Default, PartialEq, Payload)]
#[payload(ros)]
pub struct Path {
    /// Poses from the start to the end.
    pub poses: Arc<[PathPose]>,
}

/// A pose on a path.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct PathPose {
    /// Time at which the body is there; the Unix epoch if a path has no times.
    pub time: WallTime,
    /// The body's origin in the world, m.
    #[payload(unit = "m")]
    pub position: Vector3<f64>,
    /// Rotates vectors of the body to the world.
    pub world_from_body: UnitQuaternion<f64>,
}

/// The motion of a body between two times, from wheels, scans or images, without its absolute pose.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
pub struct RelativePose {
    /// The earlier time.
    pub start: MonotonicTime,
    /// The later time.
    pub end: MonotonicTime,
    /// The body's origin at the end, in its frame at the start, m.
    #[payload(unit = "m")]
    pub position: Vector3<f64>,
    /// Rotates vectors of the body's frame at the end to its frame at the start.
    pub start_from_end: UnitQuaternion<f64>,
    /// Covariance: position in the frame at the start (m²), then orientation as a small rotation of the body at the end
    /// (rad²).
    pub covariance: Option<Matrix6<f64>>,
}
