//! Motion of one joint's child, in the frame in which the joint's axis is z.

use crate::topology::JointKind;
use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// Motion of a joint, and the place of its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motion {
    /// Rotates about z.
    Turn(Coordinate),
    /// Slides along z.
    Slide(Coordinate),
    /// Slides along x and y and rotates about z: the index of the first of its three positions and velocities.
    Plane { position: usize, velocity: usize },
    /// Moves freely: the index of the first of its seven positions and six velocities.
    Free { position: usize, velocity: usize },
}

/// The coordinate of a joint, with multiplier and offset if the joint mimics another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coordinate {
    pub(super) position: usize,
    pub(super) velocity: usize,
    pub(super) multiplier: f64,
    pub(super) offset: f64,
}

impl Coordinate {
    #[inline]
    fn at(&self, positions: &[f64]) -> f64 {
        self.multiplier * positions[self.position] + self.offset
    }
}

/// The relative velocity of a child in the frame of its parent, in the axes of the child; or its derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rate {
    pub(super) linear: Vector3<f64>,
    pub(super) angular: Vector3<f64>,
}

/// The quaternion's w and z for a rotation of `angle` about z.
#[inline]
fn half(angle: f64) -> (f64, f64) {
    let (sin, cos) = (0.5 * angle).sin_cos();
    (cos, sin)
}

/// `Rz · isometry`, where the quaternion's w and z give the rotation.
#[inline]
fn turned((w, z): (f64, f64), isometry: &Isometry3<f64>) -> Isometry3<f64> {
    let (cos, sin) = (w * w - z * z, 2.0 * w * z);
    let t = &isometry.translation.vector;
    let r = &isometry.rotation.coords;
    let translation = Vector3::new(cos * t.x - sin * t.y, sin * t.x + cos * t.y, t.z);
    let rotation = Quaternion::new(w * r.w - z * r.z, w * r.x - z * r.y, w * r.y + z * r.x, w * r.z + z * r.w);
    Isometry3::from_parts(Translation3::from(translation), UnitQuaternion::new_unchecked(rotation))
}

/// The position of a floating joint. The zero quaternion is not a rotation: all poses carried by the joint become
/// NaN.
fn free(positions: &[f64]) -> Isometry3<f64> {
    let q = positions;
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(q[3], q[4], q[5], q[6]));
    Isometry3::from_parts(Translation3::new(q[0], q[1], q[2]), rotation)
}

impl Motion {
    /// `joint_from_child · child_from_tip`.
    #[inline]
    pub(super) fn carry(&self, positions: &[f64], child_from_tip: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Turn(coordinate) => turned(half(coordinate.at(positions)), child_from_tip),
            Self::Slide(coordinate) => {
                let mut joint_from_tip = *child_from_tip;
                joint_from_tip.translation.vector.z += coordinate.at(positions);
                joint_from_tip
            }
            Self::Plane { position, .. } => {
                let [x, y, angle] = [positions[*position], positions[position + 1], positions[position + 2]];
                let mut joint_from_tip = turned(half(angle), child_from_tip);
                joint_from_tip.translation.vector += Vector3::new(x, y, 0.0);
                joint_from_tip
            }
            Self::Free { position, .. } => free(&positions[*position..position + 7]) * child_from_tip,
        }
    }

    /// `child_from_joint · joint_from_tip`, the inverse.
    #[inline]
    pub(super) fn carry_back(&self, positions: &[f64], joint_from_tip: &Isometry3<f64>) -> Isometry3<f64> {
        match self {
            Self::Turn(coordinate) => turned(half(-coordinate.at(positions)), joint_from_tip),
            Self::Slide(coordinate) => {
                let mut child_from_tip = *joint_from_tip;
                child_from_tip.translation.vector.z -= coordinate.at(positions);
                child_from_tip
            }
            Self::Plane { position, .. } => {
                let [x, y, angle] = [positions[*position], positions[position + 1], positions[position + 2]];
                let mut moved = *joint_from_tip;
                moved.translation.vector -= Vector3::new(x, y, 0.0);
                turned(half(-angle), &moved)
            }
            Self::Free { position, .. } => free(&positions[*position..position + 7]).inverse() * joint_from_tip,
        }
    }

    /// Changes the indices of its positions.
    pub(super) fn renumber(&mut self, renumber: impl Fn(usize) -> usize) {
        match self {
            Self::Turn(Coordinate { position, .. }) | Self::Slide(Coordinate { position, .. }) => {
                *position = renumber(*position);
            }
            Self::Plane { position, .. } | Self::Free { position, .. } => *position = renumber(*position),
        }
    }

    /// The velocity, or its derivative, from all velocities or all their derivatives.
    pub(super) fn rate(&self, velocities: &[f64]) -> Rate {
        let v = velocities;
        let zero = Vector3::zeros();
        match *self {
            Self::Turn(Coordinate { velocity, multiplier, .. }) => {
                Rate { linear: zero, angular: Vector3::z() * (multiplier * v[velocity]) }
            }
            Self::Slide(Coordinate { velocity, multiplier, .. }) => {
                Rate { linear: Vector3::z() * (multiplier * v[velocity]), angular: zero }
            }
            Self::Plane { velocity: i, .. } => {
                Rate { linear: Vector3::new(v[i], v[i + 1], 0.0), angular: Vector3::new(0.0, 0.0, v[i + 2]) }
            }
            Self::Free { velocity: i, .. } => Rate {
                linear: Vector3::new(v[i], v[i + 1], v[i + 2]),
                angular: Vector3::new(v[i + 3], v[i + 4], v[i + 5]),
            },
        }
    }

    /// Calls `add` with each of its velocities and the effect of one unit on the child, in the axes of the child.
    #[inline]
    pub(super) fn each_velocity(&self, mut add: impl FnMut(usize, Rate)) {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
        let linear = |linear| Rate { linear, angular: Vector3::zeros() };
        let angular = |angular| Rate { linear: Vector3::zeros(), angular };
        match *self {
            Self::Turn(Coordinate { velocity, multiplier, .. }) => add(velocity, angular(z * multiplier)),
            Self::Slide(Coordinate { velocity, multiplier, .. }) => add(velocity, linear(z * multiplier)),
            Self::Plane { velocity, .. } => {
                add(velocity, linear(x));
                add(velocity + 1, linear(y));
                add(velocity + 2, angular(z));
            }
            Self::Free { velocity, .. } => {
                for (index, axis) in [x, y, z].into_iter().enumerate() {
                    add(velocity + index, linear(axis));
                    add(velocity + 3 + index, angular(axis));
                }
            }
        }
    }
}

/// A joint with coordinates of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Owner {
    pub(super) kind: JointKind,
    pub(super) position: usize,
    pub(super) velocity: usize,
}

impl Owner {
    /// The number of its velocities.
    pub(super) const fn velocities(&self) -> usize {
        match self.kind {
            JointKind::Fixed => 0,
            JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => 1,
            JointKind::Planar => 3,
            JointKind::Floating => 6,
        }
    }

    /// Moves its position by its velocity, as the exponential map does.
    pub(super) fn integrate(&self, position: &mut [f64], velocity: &[f64], duration_s: f64) {
        let Self { kind, position: p, velocity: v } = *self;
        match kind {
            JointKind::Fixed => {}
            JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => {
                position[p] += velocity[v] * duration_s;
            }
            JointKind::Planar => {
                let angle = velocity[v + 2] * duration_s;
                let moved = Vector3::new(velocity[v], velocity[v + 1], 0.0) * duration_s;
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), position[p + 2]);
                let step = turn * (mean_rotation(&(Vector3::z() * angle)) * moved);
                position[p] += step.x;
                position[p + 1] += step.y;
                position[p + 2] += angle;
            }
            JointKind::Floating => {
                let before = free(&position[p..p + 7]);
                let linear = Vector3::new(velocity[v], velocity[v + 1], velocity[v + 2]) * duration_s;
                let angular = Vector3::new(velocity[v + 3], velocity[v + 4], velocity[v + 5]) * duration_s;
                let translation = before.translation.vector + before.rotation * (mean_rotation(&angular) * linear);
                let mut rotation = before.rotation * UnitQuaternion::from_scaled_axis(angular);
                rotation.renormalize();
                let r = rotation.coords;
                position[p..p + 7].copy_from_slice(&[
                    translation.x,
                    translation.y,
                    translation.z,
                    r.w,
                    r.x,
                    r.y,
                    r.z,
                ]);
            }
        }
    }
}

/// The mean rotation along the way to `rotation`: the left Jacobian of SO(3).
fn mean_rotation(rotation: &Vector3<f64>) -> Matrix3<f64> {
    let square = rotation.norm_squared();
    // Below this angle, the first terms of the series are exact to machine precision.
    let (first, second) = if square < 1e-8 {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        let angle = square.sqrt();
        ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
    };
    let cross = rotation.cross_matrix();
    Matrix3::identity() + cross * first + cross * cross * second
}
