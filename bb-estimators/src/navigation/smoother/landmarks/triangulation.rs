//! Triangulation: where the directions to a landmark meet, with the keyframes at their estimates.

use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};

use super::Landmarks;
use crate::navigation::camera::Camera;
use crate::navigation::numbers::TRIANGULATION_STEPS;
use crate::navigation::smoother::keyframe::Window;
use crate::navigation::smoother::landmark::Landmark;
use crate::navigation::state::States;

impl<const N: usize> Landmarks<N> {
    /// Triangulates a landmark and uses it if its directions fit: `Some(true)`. `Some(false)` if they do not intersect,
    /// `None` if more observations are needed.
    pub(in crate::navigation::smoother) fn triangulate<F, S: States>(
        &mut self,
        index: usize,
        window: &Window<F, N>,
    ) -> Option<bool> {
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
pub(super) fn located<F, S: States, const N: usize>(
    landmark: &Landmark,
    camera: &Camera,
    from: Vector3<f64>,
    window: &Window<F, N>,
    first: u64,
) -> Option<Vector3<f64>> {
    let mut point = from;
    let last = window.get((landmark.sights.last()?.serial - first) as usize)?;
    let distance = (from - last.estimate::<S>().position).norm();
    for _ in 0..TRIANGULATION_STEPS {
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
