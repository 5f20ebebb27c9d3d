//! Landmarks when the oldest keyframe leaves the window.
//!
//! A landmark that it saw is one of these:
//!
//! * lost, as no recent keyframe saw it: the information of its observations about the window becomes part of the prior,
//! * still tracked: it becomes an unknown of its own, with the observations that have left as its prior; see
//!   `coupling/points.rs`,
//! * still tracked, but hardly known or without room: as lost, and then it begins again at its position, as if unknown.

use nalgebra::{Matrix3, Vector3};

use super::Landmarks;
use crate::navigation::numbers::{LANDMARK_FAR, LANDMARK_LOST_AFTER, UNKNOWN_LANDMARK};
use crate::navigation::smoother::keyframe::Window;
use crate::navigation::smoother::landmark::Landmark;

impl<const N: usize> Landmarks<N> {
    /// Called before the oldest keyframe is marginalised.
    pub(in crate::navigation::smoother) fn release<F>(&mut self, window: &mut Window<F, N>) {
        let first = self.coupling.first;
        let newest = first + window.len().saturating_sub(1) as u64;
        let mut index = 0;
        while index < self.all.len() {
            let Some(landmark) = self.all.get(index) else { break };
            let is_seen = landmark.sights.first().is_some_and(|sight| sight.serial == first);
            let mut is_lost = !landmark.is_open || landmark.last + LANDMARK_LOST_AFTER < newest;
            if landmark.slot.is_some() && !landmark.sights.is_empty() {
                // Too far from its linearisation point, as seen from where the robot is now.
                let correction = self.correction(landmark, window).norm();
                is_lost |= correction > LANDMARK_FAR * self.known_within * landmark.distance();
            }
            if let Some(slot) = landmark.slot {
                if is_lost {
                    self.drop_point(index, slot, window);
                    self.remove(index);
                    continue;
                }
                if is_seen {
                    self.settle(index, slot);
                }
            } else if is_seen && landmark.is_used {
                if is_lost || !self.carry(index, window) {
                    self.cut(index, window);
                }
            } else if is_seen && let Some(landmark) = self.all.get_mut(index) {
                landmark.sights.remove(0);
            }
            let is_empty = self.all.get(index).is_some_and(|landmark| {
                let is_lost = is_lost || !landmark.is_open;
                landmark.slot.is_none() && landmark.sights.is_empty() && is_lost
            });
            if is_empty {
                self.remove(index);
            } else {
                index += 1;
            }
        }
    }

    /// Leaves the observations of a landmark in Λ as linearised. It begins again at its estimate, as if unknown.
    fn cut<F>(&mut self, index: usize, window: &mut Window<F, N>) {
        let Some(landmark) = self.all.get(index) else { return };
        let point = self.estimate(landmark, window);
        self.fix(index, window);
        let Some(landmark) = self.all.get_mut(index) else { return };
        let distance = landmark.distance();
        landmark.sights.clear();
        landmark.point = point;
        landmark.prior = Some((point, unknown(distance)));
        landmark.is_open &= point.iter().all(|x| x.is_finite()) && distance > 0.0;
        landmark.sum();
    }

    /// Keeps the linearisation points of the keyframes that saw a landmark.
    fn fix<F>(&self, index: usize, window: &mut Window<F, N>) {
        for sight in self.all.get(index).map_or(&[][..], |landmark| &landmark.sights) {
            if let Some(keyframe) = window.get_mut((sight.serial - self.coupling.first) as usize) {
                keyframe.is_fixed = true;
            }
        }
    }

    /// Makes a landmark an unknown of its own, if it is known well enough and there is room. Returns whether it was.
    fn carry<F>(&mut self, index: usize, window: &Window<F, N>) -> bool {
        let first = self.coupling.first;
        let Some(landmark) = self.all.get(index) else { return false };
        let distance = landmark.distance();
        let is_known = landmark.deviation() <= self.known_within * distance;
        let correction = self.correction(landmark, window);
        let is_moving = correction.norm() > self.known_within * distance;
        if !is_known || is_moving || landmark.sights.len() < 2 {
            return false;
        }
        let (mean, weight) = landmark.prior.unwrap_or((landmark.point, unknown(distance)));
        let information = Matrix3::from_diagonal_element(weight);
        let vector: Vector3<f64> = (mean - landmark.point) * weight;
        let Some(slot) = self.coupling.begin_point(&information, &vector, &correction) else { return false };
        landmark.add_to(&mut self.coupling, &mut self.rows, -1.0);
        for sight in &landmark.sights {
            self.coupling.add_pose((sight.serial - first) as usize, &sight.information(), 1.0);
        }
        if let Some(landmark) = self.all.get_mut(index) {
            landmark.slot = Some(slot);
        }
        self.settle(index, slot);
        true
    }

    /// Makes the observation of the oldest keyframe part of what is known about a landmark.
    fn settle(&mut self, index: usize, slot: usize) {
        let Some(landmark) = self.all.get_mut(index) else { return };
        let sight = landmark.sights.remove(0);
        self.coupling.settle(slot, &sight.seen());
    }

    /// Eliminates a landmark that was an unknown of its own.
    fn drop_point<F>(&mut self, index: usize, slot: usize, window: &mut Window<F, N>) {
        let first = self.coupling.first;
        self.fix(index, window);
        let Some(landmark) = self.all.get_mut(index) else { return };
        landmark.slot = None;
        let seen = landmark.sights.iter().map(|sight| ((sight.serial - first) as usize, sight.seen()));
        let left = self.coupling.drop_point(slot, window.len(), seen);
        if let Some(oldest) = window.front_mut() {
            oldest.own.add(&left);
        }
        let moved = self.coupling.points();
        if let Some(landmark) = self.all.iter_mut().find(|landmark| landmark.slot == Some(moved)) {
            landmark.slot = Some(slot);
        }
    }

    /// Updates the information about landmarks from outside the window, after the oldest keyframe has left.
    pub(in crate::navigation::smoother) fn settled(&mut self) {
        for landmark in &mut self.all {
            if let Some(slot) = landmark.slot {
                landmark.settled = self.coupling.point(slot);
                landmark.sum();
            }
        }
    }
}

/// The weight of an almost uninformative prior.
fn unknown(distance: f64) -> f64 {
    let deviation = UNKNOWN_LANDMARK * distance;
    1.0 / (deviation * deviation)
}

impl Landmark {
    /// Returns the distance of the landmark from the keyframe that saw it last, m.
    fn distance(&self) -> f64 {
        self.sights.last().map_or(0.0, |sight| sight.arm.norm())
    }
}
