//! The truth over time, of the body.

use crate::navigation::data::{Truth, TruthMessage};
use crate::navigation::feed::Time;
use bb_core::nalgebra::{Isometry3, UnitQuaternion, Vector3};
use bb_estimators::navigation::LocalFrame;

/// The truth is not interpolated over longer gaps.
const LONGEST_GAP_NS: i64 = 100_000_000;

/// True states in the order of time.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrueTrack {
    points: Vec<(Time, Truth)>,
}

impl TrueTrack {
    /// Collects the truth from messages about a part of the body at `base_from_part`. Values that are not finite, or
    /// not a rotation, are left out. Positions on the Earth are those in the frame, of the part.
    pub(crate) fn new(
        messages: &[(Time, TruthMessage)],
        base_from_part: &Isometry3<f64>,
        frame: Option<&LocalFrame>,
    ) -> Self {
        // A program that does not know the velocity leaves it zero.
        let tells_velocity = messages.iter().any(|(_, message)| match message {
            TruthMessage::Moving(_, [linear, _]) => *linear != Vector3::zeros(),
            _ => false,
        });
        let mut points: Vec<(Time, Truth)> = Vec::with_capacity(messages.len());
        for (time, message) in messages {
            let truth = match message {
                TruthMessage::State(truth) => Some(*truth),
                TruthMessage::Pose(pose) => of_pose(pose, base_from_part),
                TruthMessage::Moving(pose, [linear, angular]) => of_pose(pose, base_from_part).map(|truth| {
                    let swing = angular.cross(&base_from_part.inverse().translation.vector);
                    let turned = pose.rotation * (linear + swing);
                    let velocity = (tells_velocity && is_finite(&turned)).then_some(turned);
                    Truth { velocity, ..truth }
                }),
                TruthMessage::OnEarth(at) => frame.zip(at.as_ref()).map(|(frame, at)| {
                    let position = frame.position(at);
                    Truth { position, world_from_body: None, velocity: None }
                }),
            };
            let Some(truth) = truth.filter(|truth| is_finite(&truth.position)) else { continue };
            if points.last().is_none_or(|(last, _)| last < time) {
                points.push((*time, truth));
            }
        }
        Self { points }
    }

    pub(crate) fn points(&self) -> &[(Time, Truth)] {
        &self.points
    }

    /// The truth at a time; `None` before the first, after the last, and in gaps.
    pub(crate) fn at(&self, time: Time) -> Option<Truth> {
        let next = self.points.partition_point(|(known, _)| *known < time);
        let (after_ns, after) = self.points.get(next)?;
        if *after_ns == time {
            return Some(*after);
        }
        let (before_ns, before) = self.points.get(next.checked_sub(1)?)?;
        let gap_ns = after_ns - before_ns;
        if gap_ns > LONGEST_GAP_NS {
            return None;
        }
        let part = (time - before_ns) as f64 / gap_ns as f64;
        let between = |from: &Vector3<f64>, to: &Vector3<f64>| from + (to - from) * part;
        let turned = |from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>| from.try_slerp(to, part, 1e-9);
        Some(Truth {
            position: between(&before.position, &after.position),
            world_from_body: before.world_from_body.zip(after.world_from_body).and_then(|(a, b)| turned(&a, &b)),
            velocity: before.velocity.zip(after.velocity).map(|(from, to)| between(&from, &to)),
        })
    }
}

fn of_pose(world_from_part: &Isometry3<f64>, base_from_part: &Isometry3<f64>) -> Option<Truth> {
    let world_from_base = isometry(world_from_part)? * base_from_part.inverse();
    let world_from_body = Some(world_from_base.rotation);
    Some(Truth { position: world_from_base.translation.vector, world_from_body, velocity: None })
}

/// A pose, if it is valid.
pub(super) fn isometry(pose: &Isometry3<f64>) -> Option<Isometry3<f64>> {
    let (position, quaternion) = (pose.translation, pose.rotation.into_inner());
    let is_rotation = (quaternion.norm() - 1.0).abs() < 0.1;
    (is_rotation && is_finite(&position.vector))
        .then(|| Isometry3::from_parts(position, UnitQuaternion::new_normalize(quaternion)))
}

fn is_finite(vector: &Vector3<f64>) -> bool {
    vector.iter().all(|x| x.is_finite())
}
