//! The landmarks of a window: triangulation, relinearisation, and marginalisation when a keyframe leaves.

#![allow(clippy::vec_box, reason = "landmarks move between the two lists")]

use alloc::boxed::Box;
use alloc::vec::Vec;

use nalgebra::Vector3;

mod leaving;
mod triangulation;

use super::coupling::Coupling;
use super::judging::Judging;
use super::kernel::Kernel;
use super::keyframe::Window;
use super::landmark::{Landmark, Sight};
use super::params::LandmarkParams;
use crate::navigation::camera::Camera;
use crate::navigation::chi_square::limit;
use crate::navigation::numbers::{LANDMARK_KNOWN_WITHIN, PRESSING, REWEIGHED_LANDMARK, UNFIT};
use crate::navigation::state::States;
use triangulation::located;

/// The landmarks of a window.
#[derive(Clone, Debug)]
pub(super) struct Landmarks<const N: usize> {
    pub(super) camera: Camera,
    pub(super) params: LandmarkParams,
    pub(super) coupling: Coupling<N>,
    pub(super) all: Vec<Box<Landmark>>,
    spare: Vec<Box<Landmark>>,
    rows: [Vec<f64>; 3],
    /// The gate of the observations at a keyframe.
    pub(super) judging: Judging<N>,
    /// The χ² limit above which the directions of a landmark do not intersect, indexed by their number.
    unfit: Vec<f64>,
    /// A landmark is carried on only if it is known to within this part of its distance.
    pub(super) known_within: f64,
}

impl<const N: usize> Landmarks<N> {
    pub(super) fn new(camera: Camera, params: LandmarkParams, window: usize) -> Self {
        let coupling = Coupling::new(window + 1, params.persistent.min(params.landmarks));
        let rows = [coupling.row(), coupling.row(), coupling.row()];
        let spare = (0..params.landmarks).map(|_| Box::new(Landmark::new(window + 1))).collect();
        let unfit = (0..=window + 1).map(|count| limit((2 * count).saturating_sub(3).max(1), UNFIT)).collect();
        Self {
            camera,
            params,
            coupling,
            all: Vec::with_capacity(params.landmarks),
            spare,
            rows,
            judging: Judging::new(window + 1),
            unfit,
            known_within: LANDMARK_KNOWN_WITHIN,
        }
    }

    /// Without a camera: only for factors on keyframes that are not neighbours.
    pub(super) fn none(window: usize) -> Self {
        let camera = Camera::pinhole((1.0, 1.0), (0.0, 0.0), (1.0, 1.0));
        Self::new(camera, LandmarkParams { landmarks: 0, ..LandmarkParams::default() }, window)
    }

    pub(super) fn has_camera(&self) -> bool {
        self.params.landmarks > 0
    }

    pub(super) fn clear(&mut self) {
        self.spare.append(&mut self.all);
        self.coupling.clear();
        self.judging.forget();
    }

    /// The index of a landmark that still accepts observations.
    pub(super) fn find(&self, id: u64) -> Option<usize> {
        self.all.iter().position(|landmark| landmark.id == id && landmark.is_open)
    }

    /// Begins a landmark. Returns `None` if there is no room.
    pub(super) fn begin(&mut self, id: u64, guess: Option<(Vector3<f64>, f64)>) -> Option<usize> {
        let mut landmark = self.spare.pop()?;
        landmark.renew(id, guess.map(|(mean, deviation)| (mean, 1.0 / (deviation * deviation))));
        self.all.push(landmark);
        Some(self.all.len() - 1)
    }

    pub(super) fn remove(&mut self, index: usize) {
        let landmark = self.all.swap_remove(index);
        self.spare.push(landmark);
    }

    /// The estimated position of a landmark.
    pub(super) fn estimate<F>(&self, landmark: &Landmark, window: &Window<F, N>) -> Vector3<f64> {
        landmark.point + self.correction(landmark, window)
    }

    /// The estimated offset of a landmark from its linearisation point.
    pub(super) fn correction<F>(&self, landmark: &Landmark, window: &Window<F, N>) -> Vector3<f64> {
        match landmark.slot {
            Some(slot) => self.coupling.correction(slot),
            None => landmark.correction(window, self.coupling.first),
        }
    }

    /// Begins an elimination of the window, with the landmarks that are unknowns of their own.
    pub(super) fn gather(&mut self, len: usize) {
        self.coupling.gather(len);
        let first = self.coupling.first;
        for landmark in &self.all {
            let Some(slot) = landmark.slot else { continue };
            for sight in &landmark.sights {
                self.coupling.see(slot, (sight.serial - first) as usize, &sight.seen());
            }
        }
    }

    /// Adds an observation to a landmark that is in use.
    pub(super) fn add<F, S: States>(&mut self, index: usize, sight: Sight, window: &Window<F, N>) {
        let first = self.coupling.first;
        let Some(landmark) = self.all.get(index) else { return };
        let must_move =
            landmark.slot.is_none() && (landmark.sights.is_empty() || self.is_stale(landmark, window, 1.0));
        let Some(landmark) = self.all.get_mut(index) else { return };
        landmark.last = landmark.last.max(sight.serial);
        landmark.refused_in_a_row = 0;
        if landmark.slot.is_some() {
            self.coupling.add_pose((sight.serial - first) as usize, &sight.information(), 1.0);
            landmark.insert(sight);
            landmark.sum();
            return;
        }
        if must_move {
            let point = landmark.point + landmark.correction(window, first);
            if !landmark.sights.is_empty() {
                landmark.add_to(&mut self.coupling, &mut self.rows, -1.0);
            }
            landmark.insert(sight);
            self.linearise::<F, S>(index, point, window);
            return;
        }
        landmark.add_one(&sight, &mut self.coupling, &mut self.rows, 1.0);
        landmark.insert(sight);
        landmark.sum();
        // The first observations move a landmark far. Here, this costs no further elimination.
        let Some(landmark) = self.all.get(index) else { return };
        if landmark.is_used && self.is_stale(landmark, window, 1.0) {
            let point = self.estimate(landmark, window);
            landmark.add_to(&mut self.coupling, &mut self.rows, -1.0);
            self.linearise::<F, S>(index, point, window);
        }
    }

    /// Linearises a landmark and all its observations, starting from `point`, and adds its information to the window.
    fn linearise<F, S: States>(&mut self, index: usize, point: Vector3<f64>, window: &Window<F, N>) {
        let first = self.coupling.first;
        let (camera, kernel) = (self.camera, self.params.kernel);
        let Some(landmark) = self.all.get_mut(index) else { return };
        let before = landmark.point;
        // Triangulated right now, it has not been linearised yet.
        let is_linearised = landmark.sights.iter().any(|sight| sight.arm != Vector3::zeros());
        let linearise = |landmark: &mut Landmark, place: Vector3<f64>| {
            landmark.point = place;
            landmark
                .sights
                .iter_mut()
                .all(|sight| sight.relinearise::<F, S, N>(&camera, kernel, window, first, &place))
        };
        let place = located::<F, S, N>(landmark, &camera, point, window, first).unwrap_or(point);
        // A landmark that is hardly known along its direction may move behind a camera when keyframes do. What its observations say
        // must not be lost for that.
        let mut is_seen = linearise(landmark, place);
        if !is_seen && is_linearised {
            let place = located::<F, S, N>(landmark, &camera, before, window, first).unwrap_or(before);
            is_seen = linearise(landmark, place) || linearise(landmark, before);
        }
        if !is_seen {
            let place = landmark.point;
            landmark
                .sights
                .retain_mut(|sight| sight.relinearise::<F, S, N>(&camera, kernel, window, first, &place));
        }
        landmark.sum();
        if !landmark.sights.is_empty() {
            landmark.add_to(&mut self.coupling, &mut self.rows, 1.0);
        }
    }

    /// Returns whether a landmark must be relinearised: a keyframe was, or the landmark itself moved or its kernel gives another weight by
    /// `times` the thresholds.
    fn is_stale<F>(&self, landmark: &Landmark, window: &Window<F, N>, times: f64) -> bool {
        let first = self.coupling.first;
        let correction = self.correction(landmark, window);
        let kernel = self.params.kernel;
        // One that is an unknown of its own keeps its linearisation point.
        let limit = if landmark.slot.is_some() { f64::INFINITY } else { times * self.params.relinearise };
        landmark.sights.iter().any(|sight| {
            let Some(keyframe) = window.get((sight.serial - first) as usize) else { return true };
            if sight.version != keyframe.version || correction.norm() > limit * sight.arm.norm() {
                return true;
            }
            if kernel == Kernel::Squares {
                return false;
            }
            let off = sight.residual - sight.jacobian * (correction + sight.moved(&keyframe.correction));
            (kernel.weight(off.norm_squared()) - sight.weight).abs() > times * REWEIGHED_LANDMARK
        })
    }

    /// Linearises the observations of a landmark that is an unknown of its own, at its linearisation point.
    fn linearise_sights<F>(&mut self, index: usize, window: &Window<F, N>) {
        let first = self.coupling.first;
        let Some(landmark) = self.all.get(index) else { return };
        let correction = self.correction(landmark, window);
        let (camera, kernel, coupling) = (self.camera, self.params.kernel, &mut self.coupling);
        let Some(landmark) = self.all.get_mut(index) else { return };
        let point = landmark.point;
        landmark.sights.retain_mut(|sight| {
            let at = (sight.serial - first) as usize;
            coupling.add_pose(at, &sight.information(), -1.0);
            let Some(keyframe) = window.get(at) else { return false };
            if !sight.linearise(&camera, keyframe, &point) {
                return false;
            }
            let off = sight.residual - sight.jacobian * (correction + sight.moved(&keyframe.correction));
            sight.weight = kernel.weight(off.norm_squared());
            coupling.add_pose(at, &sight.information(), 1.0);
            true
        });
        landmark.sum();
    }

    /// Relinearises the stale landmarks.
    pub(super) fn relinearise<F, S: States>(&mut self, window: &Window<F, N>) {
        for index in 0..self.all.len() {
            let Some(landmark) = self.all.get(index) else { break };
            if !landmark.is_used || landmark.sights.is_empty() || !self.is_stale(landmark, window, PRESSING) {
                continue;
            }
            if landmark.slot.is_some() {
                self.linearise_sights(index, window);
                continue;
            }
            let point = self.estimate(landmark, window);
            landmark.add_to(&mut self.coupling, &mut self.rows, -1.0);
            self.linearise::<F, S>(index, point, window);
        }
    }
}

impl Landmark {
    /// Inserts an observation in chronological order.
    pub(super) fn insert(&mut self, sight: Sight) {
        let after = self.sights.partition_point(|other| other.serial < sight.serial);
        self.sights.insert(after, sight);
    }
}
