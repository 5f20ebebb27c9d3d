//! The tangent frame of the strategy, and positions on the Earth.

use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3};

use super::given::{LinearFactor, PoseRows};
use super::input::{GnssReading, PoseAnchor, blocks};
use crate::navigation::geodesy::{Geodetic, LocalFrame};
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity};
use crate::navigation::numbers::FARTHEST_FROM_ORIGIN;
use crate::navigation::refusal::Refusal;

/// The tangent frame of the strategy.
#[derive(Clone, Copy, Debug)]
pub(super) struct World {
    frame: LocalFrame,
}

impl World {
    pub(super) fn new(origin: Geodetic) -> Self {
        Self { frame: LocalFrame::new(origin) }
    }

    pub(super) fn frame(&self) -> &LocalFrame {
        &self.frame
    }

    pub(super) fn position(&self, position: &Geodetic) -> Vector3<f64> {
        self.frame.position(position)
    }

    /// Rotates vectors from the tangent frame at a position to that of the world.
    pub(super) fn frame_from_local(&self, position: &Geodetic) -> UnitQuaternion<f64> {
        LocalFrame::new(*position).other_from_self(&self.frame).rotation
    }

    pub(super) fn anchor(&self, anchor: &PoseAnchor) -> AbsolutePose {
        let turn = self.frame_from_local(&anchor.position);
        let [position, rotation] = blocks(&anchor.covariance).map(|covariance| turned(&turn, &covariance));
        AbsolutePose {
            position: self.position(&anchor.position),
            world_from_body: turn * anchor.world_from_body,
            position_covariance: position,
            rotation_covariance: rotation,
        }
    }

    pub(super) fn fix(&self, fix: &GnssReading) -> (GnssPosition, Option<GnssVelocity>) {
        let turn = self.frame_from_local(&fix.position);
        let lever_arm = fix.lever_arm;
        let position = GnssPosition {
            position: self.position(&fix.position),
            covariance: turned(&turn, &fix.covariance),
            lever_arm,
        };
        let velocity = fix.velocity.map(|(velocity, covariance)| GnssVelocity {
            velocity: turn * velocity,
            covariance: turned(&turn, &covariance),
            lever_arm,
        });
        (position, velocity)
    }

    pub(super) fn rows(&self, linear: &LinearFactor) -> Result<PoseRows, Refusal> {
        linear.in_world(self.position(&linear.position), &self.frame_from_local(&linear.position))
    }

    /// Position on the Earth, and the rotation from the world to the tangent frame there.
    pub(super) fn local(&self, position: &Vector3<f64>) -> (Geodetic, UnitQuaternion<f64>) {
        let geodetic = self.frame.geodetic(position);
        (geodetic, self.frame_from_local(&geodetic).inverse())
    }

    /// Height above the ellipsoid, m.
    pub(super) fn height(&self, position: &Vector3<f64>) -> f64 {
        if position.xy().norm() > FARTHEST_FROM_ORIGIN {
            return self.frame.geodetic(position).height;
        }
        // Within this distance, the ellipsoid falls away from the plane by at most 2 m.
        self.frame.origin().height + position.z
    }

    /// Moves to a nearer frame if a position is far from the origin. Returns the transform of coordinates to it.
    pub(super) fn moves_on(&mut self, position: &Vector3<f64>) -> Option<Isometry3<f64>> {
        let next = self.frame.moved_on(position)?;
        let next_from_old = self.frame.other_from_self(&next);
        self.frame = next;
        Some(next_from_old)
    }
}

fn turned(turn: &UnitQuaternion<f64>, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let matrix = turn.to_rotation_matrix().into_inner();
    let turned = matrix * covariance * matrix.transpose();
    0.5 * (turned + turned.transpose())
}

/// Rotates both blocks of a covariance and their cross-correlation.
pub(super) fn turned_pose(turn: &UnitQuaternion<f64>, covariance: &Matrix6<f64>) -> Matrix6<f64> {
    let matrix = turn.to_rotation_matrix().into_inner();
    let mut both = Matrix6::zeros();
    [0, 3].iter().for_each(|first| both.fixed_view_mut::<3, 3>(*first, *first).copy_from(&matrix));
    let turned = both * covariance * both.transpose();
    0.5 * (turned + turned.transpose())
}
