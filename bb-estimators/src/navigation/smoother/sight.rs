//! Camera observations of landmarks: how they are gated and added to the window.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::filter::FixedLagSmoother;
use super::landmark::Sight;
use super::landmarks::Landmarks;
use super::params::LandmarkParams;
use crate::navigation::bounds::is_on_earth;
use crate::navigation::camera::Camera;
use crate::navigation::factor::Factor;
use crate::navigation::fused::Fused;
use crate::navigation::math::sqrt;
use crate::navigation::numbers::LEAST_SIGHT_DEVIATION;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::States;
use crate::navigation::stream::{Gate, Stream};
use crate::params::ParamsError;

/// A camera's observation of one landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The landmark's id, chosen by the camera's front end. An id that is not held begins a new landmark.
    pub landmark: u64,
    /// u, v in the distorted image.
    pub pixel: Vector2<f64>,
    /// Standard deviation of each coordinate, pixels; a thousandth at least.
    pub deviation_px: f64,
    /// Prior position of the landmark in the world, m, and the standard deviation of each component. It is used only if
    /// this observation begins the landmark. It counts as information, so it must not be given twice. The deviation is a millimetre at
    /// least.
    pub guess: Option<(Vector3<f64>, f64)>,
}

impl Observation {
    /// An observation without a guess.
    pub fn new(landmark: u64, pixel: Vector2<f64>, deviation_px: f64) -> Self {
        Self { landmark, pixel, deviation_px, guess: None }
    }
}

/// The outcome of an observation that was not refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sighted {
    /// The window uses it.
    Used(Fused),
    /// The position of the landmark is not determined yet. The observation is held, and is used once further ones determine
    /// it, unless its keyframe leaves the window before, or their directions do not intersect.
    Waiting,
}

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Sets the camera that sees landmarks. All memory for landmarks is allocated here; none is allocated later.
    /// Earlier landmarks are dropped. If they tie keyframes to each other, the window restarts at its newest keyframe with
    /// the estimate and covariance that it has with them.
    ///
    /// # Errors
    ///
    /// Returns the first parameter outside its accepted range, by name; `camera` if one of its numbers is not finite,
    /// or a focal length or the size is not positive.
    pub fn set_camera(&mut self, camera: Camera, params: LandmarkParams) -> Result<(), ParamsError> {
        params.check()?;
        camera.check()?;
        let landmarks = Landmarks::new(camera, params, self.params.window);
        if self.is_tied() {
            // Without its ties, what landmarks say about each keyframe alone would be too much.
            self.eliminate(self.window.len());
            self.solve_all();
            self.collapse();
        }
        self.landmarks = Some(landmarks);
        self.window.iter_mut().for_each(|keyframe| keyframe.seen = super::link::Information::none());
        self.dirty = 0;
        Ok(())
    }

    /// The number of landmarks that are held, and how many of them the window uses.
    pub fn landmarks(&self) -> (usize, usize) {
        let all = self.landmarks.as_ref().map_or(&[][..], |landmarks| &landmarks.all);
        (all.len(), all.iter().filter(|landmark| landmark.is_used).count())
    }

    /// The estimated position of a landmark in the world, m, as of the last update. `None` if the position is not known
    /// or the landmark is not held.
    pub fn landmark(&self, id: u64) -> Option<Vector3<f64>> {
        let landmarks = self.landmarks.as_ref()?;
        let landmark = landmarks.all.get(landmarks.find(id)?).filter(|landmark| landmark.is_used)?;
        Some(landmarks.estimate(landmark, &self.window))
    }

    /// Adds an observation of a landmark at a keyframe of the window. Observations may arrive in any order. For best
    /// results, add them after the other measurements of that keyframe, since the gate uses the keyframe's estimate.
    ///
    /// The gate of `stream` compares the observation with the estimated position of the landmark. After
    /// [`LandmarkParams::patience`] refusals in a row, the landmark is restarted.
    ///
    /// # Errors
    ///
    /// [`Refusal`], which the stream has counted; nothing is added then. [`Refusal::OutOfRange`] if the pixel is not in
    /// the image, or the guess is not on the Earth; [`Refusal::NotObservable`] if the landmark is behind the camera;
    /// [`Refusal::Repeated`] if the keyframe has already seen it; [`Refusal::Full`] if there is no room for another
    /// landmark; [`Refusal::NotStarted`] also without a camera.
    pub fn observe(&mut self, stream: &mut Stream, id: u64, seen: &Observation) -> Result<Sighted, Refusal> {
        let result = self.sight(stream, id, seen);
        match &result {
            Ok(Sighted::Used(fused)) => stream.count(&Ok(*fused)),
            Ok(Sighted::Waiting) => {}
            Err(refusal) => stream.count(&Err(*refusal)),
        }
        result
    }

    fn sight(&mut self, stream: &Stream, id: u64, seen: &Observation) -> Result<Sighted, Refusal> {
        if self.window.is_empty() || !self.landmarks.as_ref().is_some_and(Landmarks::has_camera) {
            return Err(Refusal::NotStarted);
        }
        let position = self.window.iter().rposition(|keyframe| keyframe.id == id);
        let at = position.ok_or(Refusal::NoKeyframe { id })?;
        self.prepare_judging(at, id)?;
        let (Some(landmarks), Some(keyframe)) = (&mut self.landmarks, self.window.get(at)) else {
            return Err(Refusal::NotStarted);
        };
        let serial = landmarks.coupling.first + at as u64;
        let mut sight = sighted(&landmarks.camera, seen, serial, stream.params().variance_factor)?;
        let (index, is_new) = match landmarks.find(seen.landmark) {
            Some(index) => (index, false),
            None => (landmarks.begin(seen.landmark, seen.guess).ok_or(Refusal::Full { id })?, true),
        };
        let landmark = landmarks.all.get(index).ok_or(Refusal::NotStarted)?;
        if landmark.sights.iter().any(|sight| sight.serial == serial) {
            return Err(Refusal::Repeated { landmark: seen.landmark });
        }
        if !landmark.is_used {
            return self.wait(index, sight);
        }
        // The innovation is evaluated at the linearisation point, then corrected to first order.
        if !sight.linearise(&landmarks.camera, keyframe, &landmark.point) {
            return self.refuse(index, is_new, sight, Refusal::NotObservable);
        }
        let off = landmarks.correction(landmark, &self.window) + sight.moved(&keyframe.correction);
        let innovation = sight.residual - sight.jacobian * off;
        let since = landmark.nearest(serial).map(|nearest| (nearest - landmarks.coupling.first) as usize);
        // One that nothing in the window saw is known from the keyframes before.
        let since = since.or_else(|| landmark.slot.filter(|_| at > 0).map(|_| 0));
        let judged = landmarks.judging.judge(landmark, &sight, &innovation, &self.window, since);
        let judged = judged.ok_or(Refusal::NonFinite);
        let fused = match judged.and_then(|judged| stream.weigh(&judged, 2, Gate::Closed)) {
            Ok(fused) => fused,
            Err(refusal) => return self.refuse(index, is_new, sight, refusal),
        };
        sight.precision *= sqrt(fused.weight);
        sight.jacobian *= sqrt(fused.weight);
        sight.residual *= sqrt(fused.weight);
        sight.weight = landmarks.params.kernel.weight(fused.nis);
        landmarks.add::<F, S>(index, sight, &self.window);
        self.dirty = self.dirty.min(landmarks.coupling.changed());
        Ok(Sighted::Used(fused))
    }

    /// Refuses an observation that does not fit its landmark. After too many refusals in a row, restarts the landmark
    /// with this observation.
    fn refuse(&mut self, index: usize, is_new: bool, sight: Sight, refusal: Refusal) -> Result<Sighted, Refusal> {
        let Some(landmarks) = &mut self.landmarks else { return Err(refusal) };
        if is_new {
            landmarks.remove(index);
            return Err(refusal);
        }
        let Some(landmark) = landmarks.all.get_mut(index) else { return Err(refusal) };
        landmark.refused_in_a_row += 1;
        if landmark.refused_in_a_row < landmarks.params.patience {
            return Err(refusal);
        }
        // The id now denotes another landmark. The information of the old one stays.
        let id = landmark.id;
        landmark.is_open = false;
        // One that is an unknown of its own is eliminated when the next keyframe leaves.
        if landmark.slot.is_none() && landmark.sights.is_empty() {
            landmarks.remove(index);
        }
        let index = landmarks.begin(id, None).ok_or(refusal)?;
        self.wait(index, sight)
    }

    /// Stores an observation of a landmark that is not used yet. If the landmark can now be triangulated, uses all its
    /// observations.
    fn wait(&mut self, index: usize, sight: Sight) -> Result<Sighted, Refusal> {
        let Some(landmarks) = &mut self.landmarks else { return Err(Refusal::NotStarted) };
        let Some(landmark) = landmarks.all.get_mut(index) else { return Err(Refusal::NotStarted) };
        let serial = sight.serial;
        landmark.last = landmark.last.max(serial);
        landmark.insert(sight);
        match landmarks.triangulate::<F, S>(index, &self.window) {
            Some(true) => self.dirty = self.dirty.min(landmarks.coupling.changed()),
            // The directions do not intersect: restart from the last one.
            Some(false) => {
                if let Some(landmark) = landmarks.all.get_mut(index) {
                    landmark.sights.retain(|sight| sight.serial == serial);
                }
                return Err(Refusal::NotObservable);
            }
            None => {}
        }
        Ok(Sighted::Waiting)
    }

    /// Makes sure that the covariances are those of this keyframe.
    fn prepare_judging(&mut self, at: usize, id: u64) -> Result<(), Refusal> {
        let is_known = self.landmarks.as_ref().is_some_and(|landmarks| landmarks.judging.is_of(id));
        if is_known {
            return Ok(());
        }
        self.eliminate(self.window.len());
        self.solve_all();
        let covariance = self.covariance_now(at).ok_or(Refusal::NotObservable)?;
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.judging.begin(id, at, &covariance);
        }
        Ok(())
    }
}

/// An undistorted observation at a keyframe.
fn sighted(camera: &Camera, seen: &Observation, serial: u64, factor: f64) -> Result<Sight, Refusal> {
    if let Some((position, deviation)) = seen.guess {
        if !position.iter().all(|x| x.is_finite()) || deviation.is_nan() {
            return Err(Refusal::NonFinite);
        }
        if !is_on_earth(&position) {
            return Err(Refusal::OutOfRange);
        }
        if !(LEAST_SIGHT_DEVIATION..=1e9).contains(&deviation) {
            return Err(Refusal::Noise);
        }
    }
    if seen.deviation_px.is_nan() {
        return Err(Refusal::NonFinite);
    }
    if !(LEAST_SIGHT_DEVIATION..=1e6).contains(&seen.deviation_px) {
        return Err(Refusal::Noise);
    }
    let precision = 1.0 / (seen.deviation_px * sqrt(factor));
    Ok(Sight {
        serial,
        version: 0,
        seen: camera.undistorted(&seen.pixel)?,
        precision,
        weight: 1.0,
        jacobian: Matrix2x3::zeros(),
        residual: Vector2::zeros(),
        arm: Vector3::zeros(),
    })
}
