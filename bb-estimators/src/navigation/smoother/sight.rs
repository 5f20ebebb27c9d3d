//! Landmarks as a camera sees them: observations arrive, are judged, and are added to the window.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};

use super::coupling::POSE;
use super::factor::Factor;
use super::filter::FixedLagSmoother;
use super::landmark::{Landmark, Sight, pose_block};
use super::landmarks::{Judging, Landmarks, projected};
use super::params::LandmarkParams;
use crate::navigation::bounds::is_on_earth;
use crate::navigation::camera::Camera;
use crate::navigation::fused::Fused;
use crate::navigation::math::{ln, sqrt};
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{ACCELEROMETER_BIAS, GYROSCOPE_BIAS, States, VELOCITY};
use crate::navigation::stream::{Gate, Stream};
use crate::params::ParamsError;

/// What a camera saw of one landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Which one, by a number of the camera's choice: an id that is not held begins a landmark.
    pub landmark: u64,
    /// u, v, as the lens shows it.
    pub pixel: Vector2<f64>,
    /// Standard deviation of each of them, pixels.
    pub deviation_px: f64,
    /// Where the landmark is known to be in the world, m, and the standard deviation of each component. It is used if the
    /// landmark begins with this observation: it is information, and must not be given twice.
    pub guess: Option<(Vector3<f64>, f64)>,
}

impl Observation {
    /// Without a guess.
    pub fn new(landmark: u64, pixel: Vector2<f64>, deviation_px: f64) -> Self {
        Self { landmark, pixel, deviation_px, guess: None }
    }
}

/// What became of an observation that was not refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sighted {
    /// The window uses it.
    Used(Fused),
    /// Where the landmark is cannot be told yet; it will be used when that can.
    Waiting,
}

impl<S: States, const N: usize, F: Factor<S, N>> FixedLagSmoother<S, N, F> {
    /// Sets the camera that sees landmarks. This is when memory for them is taken; later, none is. Landmarks of before are
    /// forgotten, what they said of the window included.
    ///
    /// # Errors
    ///
    /// The first parameter outside its accepted range, by name; `camera` if a number of it is not finite, or a focal length
    /// or the size not positive.
    pub fn set_camera(&mut self, camera: Camera, params: LandmarkParams) -> Result<(), ParamsError> {
        params.check()?;
        if !camera.is_sound() {
            let (min, max) = (f64::MIN_POSITIVE, f64::MAX);
            return Err(ParamsError { parameter: "camera", value: camera.focal_length.x, min, max, unit: "px" });
        }
        self.landmarks = Some(Landmarks::new(camera, params, self.params.window));
        self.window.iter_mut().for_each(|keyframe| keyframe.seen = super::coupling::PoseInformation::none());
        self.dirty = 0;
        Ok(())
    }

    /// How many landmarks are held, and how many of them the window uses.
    pub fn landmarks(&self) -> (usize, usize) {
        let all = self.landmarks.as_ref().map_or(&[][..], |landmarks| &landmarks.all);
        (all.len(), all.iter().filter(|landmark| landmark.is_used).count())
    }

    /// Where a landmark is estimated to be in the world, m, as of the last update; none if that is not known, or the
    /// landmark is not held.
    pub fn landmark(&self, id: u64) -> Option<Vector3<f64>> {
        let landmarks = self.landmarks.as_ref()?;
        let landmark = landmarks.all.get(landmarks.find(id)?).filter(|landmark| landmark.is_used)?;
        Some(landmarks.estimate(landmark, &self.window))
    }

    /// Adds what the camera saw of a landmark at a keyframe of the window, in any order; best after all else that was
    /// measured at that keyframe, as landmarks are judged by what is known of it.
    ///
    /// The gate of `stream` compares it with where the landmark is estimated to be. The stream's patience is not used:
    /// after [`LandmarkParams::patience`] refusals in a row it is the landmark that begins again.
    ///
    /// # Errors
    ///
    /// [`Refusal`], which the stream has counted; nothing is added then. [`Refusal::OutOfRange`] if the pixel is not in the
    /// image, or the guess not on the Earth, [`Refusal::NotObservable`] if the landmark is behind the camera, [`Refusal::Repeated`] if the keyframe has
    /// seen it already, [`Refusal::Full`] if there is no room for another, [`Refusal::NotStarted`] also without a camera.
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
        if self.window.is_empty() || self.landmarks.is_none() {
            return Err(Refusal::NotStarted);
        }
        let position = self.window.iter().rposition(|keyframe| keyframe.id == id);
        let at = position.ok_or(Refusal::NoKeyframe { id })?;
        let judging = self.judging(at, id)?;
        let (Some(landmarks), Some(keyframe)) = (&mut self.landmarks, self.window.get(at)) else {
            return Err(Refusal::NotStarted);
        };
        let serial = landmarks.coupling.first + at as u64;
        let mut sight = sighted(&landmarks.camera, seen, serial, stream.noise_factor())?;
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
        // A landmark is judged where it is linearised, but for its correction.
        if !sight.linearise(&landmarks.camera, keyframe, &landmark.point) {
            return self.refuse(index, is_new, sight, Refusal::NotObservable);
        }
        let off = landmark.correction(&self.window, landmarks.coupling.first) + sight.moved(&keyframe.correction);
        let innovation = sight.residual - sight.jacobian * off;
        let judged = judge(landmark, &sight, &innovation, &judging).ok_or(Refusal::NonFinite);
        let log_density = judged.map_or(0.0, |judged| judged.log_density);
        let verdict = judged.and_then(|judged| {
            let verdict = stream.weigh(judged.nis, 2, log_density, Gate::Closed)?;
            // A landmark is never what all else is adapted to.
            if verdict.raised > 1.0 {
                return Err(Refusal::Gate { nis: judged.nis, limit: verdict.limit });
            }
            Ok((judged, verdict))
        });
        let (judged, verdict) = match verdict {
            Ok(verdict) => verdict,
            Err(refusal) => return self.refuse(index, is_new, sight, refusal),
        };
        sight.precision *= sqrt(verdict.weight);
        sight.jacobian *= sqrt(verdict.weight);
        sight.residual *= sqrt(verdict.weight);
        sight.weight = landmarks.params.kernel.weight(judged.nis);
        landmarks.add::<F, S>(index, sight, &self.window);
        self.dirty = 0;
        Ok(Sighted::Used(Fused {
            nis: judged.nis,
            dimension: 2,
            weight: verdict.weight,
            raised: 1.0,
            limit: verdict.limit,
            log_likelihood: verdict.log_likelihood,
            whitened: judged.whitened,
        }))
    }

    /// Refuses an observation of a landmark that it does not fit, or begins the landmark again with it once too many did not.
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
        // It is another landmark by now. What the old one said stays.
        let id = landmark.id;
        landmark.is_open = false;
        if landmark.sights.is_empty() {
            landmarks.remove(index);
        }
        let index = landmarks.begin(id, None).ok_or(refusal)?;
        self.wait(index, sight)
    }

    /// Keeps an observation of a landmark that is not used yet, and uses all of them if that makes it known.
    fn wait(&mut self, index: usize, sight: Sight) -> Result<Sighted, Refusal> {
        let Some(landmarks) = &mut self.landmarks else { return Err(Refusal::NotStarted) };
        let Some(landmark) = landmarks.all.get_mut(index) else { return Err(Refusal::NotStarted) };
        let serial = sight.serial;
        landmark.last = landmark.last.max(serial);
        landmark.insert(sight);
        match landmarks.triangulate::<F, S>(index, &self.window) {
            Some(true) => self.dirty = 0,
            // They do not meet: it begins again from the last.
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

    /// What is known of a keyframe before it sees the first landmark.
    fn judging(&mut self, at: usize, id: u64) -> Result<Judging, Refusal> {
        let known = self.landmarks.as_ref().and_then(|landmarks| landmarks.judged);
        if let Some((_, judging)) = known.filter(|(judged, _)| *judged == id) {
            return Ok(judging);
        }
        self.eliminate(self.window.len());
        self.solve_all();
        let covariance = self.covariance_now(at).ok_or(Refusal::NotObservable)?;
        let keyframe = self.window.get(at).ok_or(Refusal::NoKeyframe { id })?;
        let mut step = SMatrix::zeros();
        if at > 0 {
            let seconds = keyframe.motion.seconds();
            step = pose_block(&keyframe.link.noise);
            // In the world's axes, as the pose is.
            let to_world = keyframe.point.rotation();
            let block = |first: usize| Matrix3::from_fn(|i, j| covariance[first + i][first + j]);
            let turned = |first: usize| to_world * block(first) * to_world.transpose();
            let fallen = 0.5 * seconds * seconds;
            let position = block(VELOCITY) * (seconds * seconds) + turned(ACCELEROMETER_BIAS) * (fallen * fallen);
            let rotation = turned(GYROSCOPE_BIAS) * (seconds * seconds);
            let mut sum = step.fixed_view_mut::<3, 3>(0, 0);
            sum += position;
            let mut sum = step.fixed_view_mut::<3, 3>(3, 3);
            sum += rotation;
        }
        let judging = Judging { pose: pose_block(&covariance), step };
        if let Some(landmarks) = &mut self.landmarks {
            landmarks.judged = Some((id, judging));
        }
        Ok(judging)
    }
}

/// An observation without distortion, at a keyframe.
fn sighted(camera: &Camera, seen: &Observation, serial: u64, factor: f64) -> Result<Sight, Refusal> {
    if let Some((position, deviation)) = seen.guess {
        if !position.iter().all(|x| x.is_finite()) || deviation.is_nan() {
            return Err(Refusal::NonFinite);
        }
        if !is_on_earth(&position) {
            return Err(Refusal::OutOfRange);
        }
        if !(1e-6..=1e9).contains(&deviation) {
            return Err(Refusal::Noise);
        }
    }
    if seen.deviation_px.is_nan() {
        return Err(Refusal::NonFinite);
    }
    if !(1e-6..=1e6).contains(&seen.deviation_px) {
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

/// An observation before it is used.
#[derive(Clone, Copy, Debug)]
struct Judged {
    nis: f64,
    log_density: f64,
    whitened: f64,
}

/// Compares an observation with where the landmark is estimated to be.
///
/// What is common to all keyframes moves the landmark along, but for the part of it that its prior holds; what is not is the
/// noise of the last step.
fn judge(landmark: &Landmark, sight: &Sight, innovation: &Vector2<f64>, judging: &Judging) -> Option<Judged> {
    let jacobian = sight.jacobian;
    let along = |share: Matrix2x3<f64>| {
        let mut whole = SMatrix::<f64, 2, POSE>::zeros();
        whole.fixed_columns_mut::<3>(0).copy_from(&-share);
        whole.fixed_columns_mut::<3>(3).copy_from(&(share * sight.arm.cross_matrix()));
        whole
    };
    let mut covariance = Matrix2::identity() + landmark.spread(&jacobian);
    covariance += projected(&along(jacobian * landmark.held()), &judging.pose);
    covariance += projected(&along(jacobian), &judging.step);
    let root = covariance.cholesky()?.l();
    let whitened = root.solve_lower_triangular(innovation)?;
    let nis = whitened.norm_squared();
    let noise = sight.seen.jacobian * sight.precision;
    let density = ln(noise.determinant().abs()) - ln(root[(0, 0)] * root[(1, 1)]);
    nis.is_finite().then_some(Judged { nis, log_density: density, whitened: whitened.x })
}
