//! The landmarks of a window: triangulation, relinearisation, and marginalisation when a keyframe leaves.

#![allow(clippy::vec_box, reason = "landmarks move between the two lists")]

use alloc::boxed::Box;
use alloc::vec::Vec;

use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};

use super::coupling::{Coupling, POSE};
use super::kernel::Kernel;
use super::keyframe::Window;
use super::landmark::{Landmark, Sight};
use super::params::LandmarkParams;
use crate::navigation::camera::Camera;
use crate::navigation::chi_square::limit;
use crate::navigation::state::States;

/// A landmark is relinearised if the kernel's weight of an observation differs from the current one by more than this.
const REWEIGHED: f64 = 0.1;

/// A landmark that continues without a prior is given a standard deviation of this many times its distance: almost no
/// information, but never singular.
const UNKNOWN: f64 = 100.0;

/// Gauss–Newton steps for a single landmark.
const STEPS: usize = 5;

/// A landmark that none of this many newest keyframes saw is lost: it is not continued once its first keyframe leaves.
const LOST_AFTER: u64 = 5;

/// The fraction of good landmarks that are rejected because their directions do not intersect.
const UNFIT: f64 = 1e-4;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Landmarks<const N: usize> {
    pub(super) camera: Camera,
    pub(super) params: LandmarkParams,
    pub(super) coupling: Coupling<N>,
    pub(super) all: Vec<Box<Landmark>>,
    spare: Vec<Box<Landmark>>,
    rows: [Vec<f64>; 3],
    /// The pose covariances used to gate the observations of a keyframe, with that keyframe's id.
    pub(super) judged: Option<(u64, Judging)>,
    /// The χ² limit above which the directions of a landmark do not intersect, indexed by their number.
    unfit: Vec<f64>,
}

/// The covariances with which the observations at one keyframe are gated.
#[derive(Clone, Copy, Debug)]
pub(super) struct Judging {
    /// Covariance of the pose.
    pub(super) pose: SMatrix<f64, POSE, POSE>,
    /// The part that is independent of the previous keyframes.
    pub(super) step: SMatrix<f64, POSE, POSE>,
}

impl<const N: usize> Landmarks<N> {
    pub(super) fn new(camera: Camera, params: LandmarkParams, window: usize) -> Self {
        let coupling = Coupling::new(window + 1);
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
            judged: None,
            unfit,
        }
    }

    pub(super) fn clear(&mut self) {
        self.spare.append(&mut self.all);
        self.coupling.clear();
        self.judged = None;
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
        landmark.point + landmark.correction(window, self.coupling.first)
    }

    /// Adds an observation to a landmark that is in use.
    pub(super) fn add<F, S: States>(&mut self, index: usize, sight: Sight, window: &Window<F, N>) {
        let first = self.coupling.first;
        let Some(landmark) = self.all.get(index) else { return };
        let must_move = landmark.sights.is_empty() || self.is_stale(landmark, window);
        let Some(landmark) = self.all.get_mut(index) else { return };
        landmark.last = landmark.last.max(sight.serial);
        landmark.refused_in_a_row = 0;
        if !must_move {
            landmark.add_one(&sight, &mut self.coupling, &mut self.rows, 1.0);
            landmark.insert(sight);
            landmark.sum();
            return;
        }
        let point = landmark.point + landmark.correction(window, first);
        if !landmark.sights.is_empty() {
            landmark.add_to(&mut self.coupling, &mut self.rows, -1.0);
        }
        landmark.insert(sight);
        self.linearise::<F, S>(index, point, window);
    }

    /// Linearises a landmark and all its observations, starting from `point`, and adds its information to the window.
    fn linearise<F, S: States>(&mut self, index: usize, point: Vector3<f64>, window: &Window<F, N>) {
        let first = self.coupling.first;
        let (camera, kernel) = (self.camera, self.params.kernel);
        let Some(landmark) = self.all.get_mut(index) else { return };
        landmark.point = located::<F, S, N>(landmark, &camera, point, window, first).unwrap_or(point);
        let place = landmark.point;
        landmark.sights.retain_mut(|sight| {
            let Some(keyframe) = window.get((sight.serial - first) as usize) else { return false };
            let Some((_, residual)) = sight.estimated::<F, S, N>(&camera, keyframe, &place) else { return false };
            sight.weight = kernel.weight(residual.norm_squared());
            sight.linearise(&camera, keyframe, &place)
        });
        landmark.sum();
        if !landmark.sights.is_empty() {
            landmark.add_to(&mut self.coupling, &mut self.rows, 1.0);
        }
    }

    /// Triangulates a landmark and uses it if its directions fit: `Some(true)`. `Some(false)` if they do not intersect,
    /// `None` if more observations are needed.
    pub(super) fn triangulate<F, S: States>(&mut self, index: usize, window: &Window<F, N>) -> Option<bool> {
        let first = self.coupling.first;
        let (camera, params) = (self.camera, self.params);
        let landmark = self.all.get_mut(index)?;
        let point = meeting::<F, S, N>(landmark, &camera, params.parallax, window, first)?;
        let Some(point) = located::<F, S, N>(landmark, &camera, point, window, first) else { return Some(false) };
        let mut squared = 0.0;
        for sight in &landmark.sights {
            let keyframe = window.get((sight.serial - first) as usize)?;
            let Some((_, residual)) = sight.estimated::<F, S, N>(&camera, keyframe, &point) else {
                return Some(false);
            };
            squared += residual.norm_squared();
        }
        // The residuals are unweighted here, so an outlier counts in full.
        let is_fit = squared <= self.unfit.get(landmark.sights.len()).copied().unwrap_or(f64::INFINITY);
        if !is_fit {
            return Some(false);
        }
        landmark.is_used = true;
        self.linearise::<F, S>(index, point, window);
        Some(true)
    }

    /// Whether a landmark must be relinearised: a keyframe or the landmark itself moved, or its kernel gives another weight.
    fn is_stale<F>(&self, landmark: &Landmark, window: &Window<F, N>) -> bool {
        let first = self.coupling.first;
        let correction = landmark.correction(window, first);
        let kernel = self.params.kernel;
        let limit = self.params.relinearise;
        landmark.sights.iter().any(|sight| {
            let Some(keyframe) = window.get((sight.serial - first) as usize) else { return true };
            if sight.version != keyframe.version || correction.norm() > limit * sight.arm.norm() {
                return true;
            }
            if kernel == Kernel::Squares {
                return false;
            }
            let off = sight.residual - sight.jacobian * (correction + sight.moved(&keyframe.correction));
            (kernel.weight(off.norm_squared()) - sight.weight).abs() > REWEIGHED
        })
    }

    /// Relinearises the stale landmarks and returns their number.
    pub(super) fn relinearise<F, S: States>(&mut self, window: &Window<F, N>) -> usize {
        let mut count = 0;
        for index in 0..self.all.len() {
            let Some(landmark) = self.all.get(index) else { break };
            if !landmark.is_used || landmark.sights.is_empty() || !self.is_stale(landmark, window) {
                continue;
            }
            let point = self.estimate(landmark, window);
            landmark.add_to(&mut self.coupling, &mut self.rows, -1.0);
            self.linearise::<F, S>(index, point, window);
            count += 1;
        }
        count
    }

    /// Called before the oldest keyframe is marginalised. The observations of its landmarks stay in Λ as linearised,
    /// and these landmarks restart at their estimates as if they were unknown.
    pub(super) fn release<F>(&mut self, window: &mut Window<F, N>) {
        let first = self.coupling.first;
        let newest = first + window.len().saturating_sub(1) as u64;
        let mut index = 0;
        while index < self.all.len() {
            let Some(landmark) = self.all.get(index) else { break };
            let is_seen = landmark.sights.first().is_some_and(|sight| sight.serial == first);
            let point = landmark.point + landmark.correction(window, first);
            let Some(landmark) = self.all.get_mut(index) else { break };
            if is_seen && landmark.is_used {
                for sight in &landmark.sights {
                    if let Some(keyframe) = window.get_mut((sight.serial - first) as usize) {
                        keyframe.is_fixed = true;
                    }
                }
                let distance = landmark.sights.last().map_or(0.0, |sight| sight.arm.norm());
                landmark.sights.clear();
                landmark.point = point;
                let deviation = UNKNOWN * distance;
                landmark.prior = Some((point, 1.0 / (deviation * deviation)));
                landmark.is_open &= point.iter().all(|x| x.is_finite()) && deviation > 0.0;
                landmark.sum();
            } else if is_seen {
                landmark.sights.remove(0);
            }
            let is_lost = !landmark.is_open || landmark.last + LOST_AFTER < newest;
            if landmark.sights.is_empty() && is_lost {
                self.remove(index);
            } else {
                index += 1;
            }
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

/// Intersects the directions, with the keyframes at their estimates. Returns `None` if the directions are nearly parallel.
fn meeting<F, S: States, const N: usize>(
    landmark: &Landmark,
    camera: &Camera,
    parallax: f64,
    window: &Window<F, N>,
    first: u64,
) -> Option<Vector3<f64>> {
    let mut matrix = Matrix3::zeros();
    let mut vector = Vector3::zeros();
    let mut widest = 1.0_f64;
    let mut reference = None;
    for sight in &landmark.sights {
        let keyframe = window.get((sight.serial - first) as usize)?;
        let at = keyframe.estimate::<S>();
        let (camera_from_world, centre) = camera.placed(&at.position, &at.world_from_body);
        let direction = camera_from_world.transpose() * sight.seen.direction.push(1.0).normalize();
        widest = widest.min(direction.dot(reference.get_or_insert(direction)));
        let across = Matrix3::identity() - direction * direction.transpose();
        matrix += across;
        vector += across * centre;
    }
    if widest.is_nan() || widest >= crate::navigation::math::cos(parallax) {
        return None;
    }
    matrix.cholesky().map(|root| root.solve(&vector)).filter(|point| point.iter().all(|x| x.is_finite()))
}

/// Refines the position of a landmark by Gauss–Newton steps from `point`, with the keyframes at their estimates.
/// Returns `None` if the landmark cannot have been seen there.
fn located<F, S: States, const N: usize>(
    landmark: &Landmark,
    camera: &Camera,
    from: Vector3<f64>,
    window: &Window<F, N>,
    first: u64,
) -> Option<Vector3<f64>> {
    let mut point = from;
    let last = window.get((landmark.sights.last()?.serial - first) as usize)?;
    let distance = (from - last.estimate::<S>().position).norm();
    for _ in 0..STEPS {
        let mut matrix = Matrix3::zeros();
        let mut vector = Vector3::zeros();
        if let Some((mean, weight)) = landmark.prior {
            matrix += Matrix3::from_diagonal_element(weight);
            vector += (mean - point) * weight;
        }
        for sight in &landmark.sights {
            let keyframe = window.get((sight.serial - first) as usize)?;
            let (jacobian, residual): (Matrix2x3<f64>, Vector2<f64>) =
                sight.estimated::<F, S, N>(camera, keyframe, &point)?;
            matrix += jacobian.transpose() * jacobian * sight.weight;
            vector += jacobian.transpose() * residual * sight.weight;
        }
        let step = matrix.cholesky()?.solve(&vector);
        point += step;
        if !point.iter().all(|x| x.is_finite()) {
            return None;
        }
        if step.norm() < 1e-5 * distance {
            break;
        }
    }
    Some(point)
}

/// `B P Bᵀ` for a 2-dimensional observation.
pub(super) fn projected(jacobian: &SMatrix<f64, 2, POSE>, covariance: &SMatrix<f64, POSE, POSE>) -> Matrix2<f64> {
    jacobian * covariance * jacobian.transpose()
}
