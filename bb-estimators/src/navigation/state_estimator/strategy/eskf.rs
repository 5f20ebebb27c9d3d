//! The error-state Kalman filter.
//!
//! # After an outage of the IMU
//!
//! A filter corrects the attitude linearly. A gap of more than half a second leaves it too uncertain for that: it is *lost* until
//! something determines it as a whole,
//!
//! * an anchor, which is in doubt until the next position fits: it may be an outlier,
//! * an attitude of the flight controller,
//! * a relative pose that begins before the gap,
//! * fixes, by the motion that the IMU has measured since the gap, see `realignment.rs`,
//! * or a restart.
//!
//! Meanwhile the body is assumed to keep its velocity, as in a gap, and measurements correct position and velocity alone: what the
//! accelerometer measures has no direction in the world. Their covariance is right, so the gates judge as they should. Relative poses
//! between frames since the gap are refused: they begin at a pose of unknown attitude.
//! A lost or doubtful attitude makes the estimate degraded. Without a horizontal acceleration, fixes do not show the heading, and it
//! remains so.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::{Isometry3, Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::{Cadence, Failure, Measured, Place, Pose, Predictor, Streams, Trust, add_time, id_of, trusting};
use crate::attitude::ParamsError;
use crate::navigation::eskf::{Eskf, ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::jump::UNKNOWN;
use crate::navigation::measurement::{
    AbsolutePose, GnssPosition, GnssVelocity, Linearised, Measurement, RelativePose,
};
use crate::navigation::navigator::{NAVIGATED, Navigated};
use crate::navigation::realignment::{KNOWN, Realigned, Realignment};
use crate::navigation::refusal::Refusal;
use crate::navigation::smoother::{Factor, Rows};
use crate::navigation::state::{Estimate, NAVIGATION, Optional, ROTATION, States, VELOCITY, offset};
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::params::StateEstimatorConfig;
use crate::navigation::stream::Stream;

/// Standard deviation of the attitude after a gap, rad, from which on a filter does not correct it: a gap of two thirds of a second.
const LOST: f64 = 0.8;

/// Standard deviation of an attitude that is well known, rad.
const WELL: f64 = 0.3;

/// Standard deviation of the velocity, m/s, from which on a relative pose is linearised where it leads: the way between two frames is then
/// wrong by more than the camera is.
const SLOW: f64 = 1.0;

/// Number of times that it is.
const ITERATIONS: usize = 3;

/// Whether the attitude is known well enough to be corrected.
#[derive(Clone, Debug)]
enum Attitude {
    Known,
    /// From a single anchor. The next position has to fit.
    Doubted,
    /// `None` if the state before the gap was unusable.
    Lost(Option<Box<Realignment>>),
}

/// See the module.
#[derive(Clone, Debug)]
pub(in crate::navigation::state_estimator) struct EskfStrategy {
    filter: Eskf<Navigated, NAVIGATED>,
    streams: Streams,
    cadence: Cadence,
    /// Estimates at the last keyframes, the newest last. They are never corrected.
    past: VecDeque<Pose>,
    window: usize,
    records: bool,
    left: Option<Pose>,
    /// Whether the present becomes the reference of the next relative pose, once all measurements at this time are fused.
    is_next: bool,
    attitude: Attitude,
    /// What gaps have added to the variance of each axis of the attitude since it was last well known, rad².
    by_gaps: f64,
    /// Whether the velocity may be wrong by more than [`SLOW`], because the attitude was lost.
    is_fast: bool,
}

impl EskfStrategy {
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        let window = config.params.window as usize;
        Ok(Self {
            filter: Eskf::new(config.sensors)?,
            streams: Streams::new(),
            cadence: Cadence::new(config),
            past: VecDeque::with_capacity(window + 1),
            window,
            records: config.params.record_keyframes,
            left: None,
            is_next: false,
            attitude: Attitude::Known,
            by_gaps: 0.0,
            is_fast: false,
        })
    }

    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.filter.start(start)?;
        self.know(Attitude::Known);
        self.begin(start.time_ns);
        // Earlier refusals relate to another estimate.
        self.streams.anchors.forgive();
        Ok(())
    }

    /// The present state is the first keyframe.
    fn begin(&mut self, time_ns: i64) {
        self.filter.set_keyframe(id_of(time_ns));
        self.cadence.begin(time_ns);
        self.is_next = false;
        self.past.clear();
        self.past.extend(self.pose());
    }

    pub(super) fn propagate(&mut self, sample: &ImuMean, is_gap: bool) -> Result<(), Failure> {
        if self.is_next {
            self.is_next = false;
            // A frame of unknown attitude must not replace one from before the gap.
            if !self.is_lost() {
                self.filter.set_keyframe(id_of(self.cadence.camera_ns));
            }
        }
        let (gaps, before_ns) = (self.filter.gaps(), self.filter.estimate().map(|estimate| estimate.time_ns));
        self.filter.propagate_part(sample, is_gap)?;
        if self.filter.gaps() != gaps {
            self.bridged(sample.time_ns.saturating_sub(before_ns.unwrap_or(sample.time_ns)) as f64 * 1e-9);
        } else if let Attitude::Lost(Some(realignment)) = &mut self.attitude {
            realignment.propagate(sample);
        }
        if self.cadence.is_due(sample.time_ns) { self.keyframe() } else { Ok(()) }
    }

    pub(super) fn camera_frame(&mut self) -> Result<(), Failure> {
        self.keyframe()?;
        self.cadence.camera_frame();
        self.is_next = true;
        Ok(())
    }

    fn keyframe(&mut self) -> Result<(), Failure> {
        let pose = self.pose().ok_or(Refusal::NotStarted)?;
        if pose.time_ns == self.cadence.keyframe_ns {
            return Ok(());
        }
        if !pose.is_finite() {
            return Err(Failure::Fatal(Refusal::NonFinite));
        }
        self.cadence.keyframe_ns = pose.time_ns;
        self.past.push_back(pose);
        if self.past.len() > self.window {
            self.left = self.past.pop_front().filter(|_| self.records);
        }
        Ok(())
    }

    pub(super) fn measure<F: ProvidedFactor>(&mut self, measured: &Measured<'_, F>) -> Result<Fused, Failure> {
        let fused = match measured {
            Measured::Relative(pose) => self.relative(pose)?,
            Measured::Anchor(pose, trust) => self.anchor(pose, *trust)?,
            Measured::Gnss(position, velocity, trust) => self.gnss(position, velocity.as_ref(), *trust)?,
            Measured::Provided(factor) => update(&mut self.filter, &mut self.streams.provided, *factor)?,
        };
        let pose = self.pose().filter(Pose::is_finite).ok_or(Failure::Fatal(Refusal::NonFinite))?;
        // A measurement at a keyframe belongs to that keyframe.
        if let Some(newest) = self.past.back_mut().filter(|newest| newest.time_ns == pose.time_ns) {
            *newest = pose;
        }
        Ok(fused)
    }

    fn relative(&mut self, pose: &RelativePose) -> Result<Fused, Failure> {
        if !self.is_lost() {
            return self.relate(pose).map_err(absurd);
        }
        if !self.is_keyframe_known() {
            return Err(Refusal::NoKeyframe { id: pose.keyframe }.into());
        }
        let before = self.filter;
        self.filter.set_attitude_from_keyframe(&pose.keyframe_from_body, UNKNOWN * UNKNOWN)?;
        self.filter.hold_attitude(false);
        self.is_fast = true;
        match self.relate(pose) {
            Ok(fused) => {
                self.know(Attitude::Known);
                Ok(fused)
            }
            Err(refusal) => {
                self.filter = before;
                Err(absurd(refusal))
            }
        }
    }

    /// Fuses a relative pose. Its derivative with respect to the attitude of the keyframe is the way since. As long as an unknown velocity
    /// makes that a wrong one, the pose is linearised again where it leads: else it seems to tell the attitude, and tells a wrong one.
    fn relate(&mut self, pose: &RelativePose) -> Result<Fused, Refusal> {
        let covariance = self.filter.covariance();
        self.is_fast &= (VELOCITY..VELOCITY + 3).any(|i| covariance[(i, i)] > SLOW * SLOW);
        let (true, Some(estimate)) = (self.is_fast, self.filter.estimate().copied()) else {
            return self.filter.update(&mut self.streams.relative, pose);
        };
        let mut at = estimate;
        for _ in 0..ITERATIONS {
            let mut led = self.filter;
            led.update_ungated(&mut Stream::default(), &Relinearised::new(pose, &estimate, &at)?)?;
            at = *led.estimate().ok_or(Refusal::NotStarted)?;
        }
        self.filter.update(&mut self.streams.relative, &Relinearised::new(pose, &estimate, &at)?)
    }

    fn anchor(&mut self, pose: &AbsolutePose, trust: Trust) -> Result<Fused, Failure> {
        let stream = trusting(&mut self.streams.anchors, trust);
        if !matches!(self.attitude, Attitude::Lost(_)) {
            let result = self.filter.update(stream, pose);
            match &result {
                Ok(fused) => self.fits(fused),
                Err(Refusal::Gate { .. }) if matches!(self.attitude, Attitude::Doubted) => self.lose(),
                Err(_) => {}
            }
            return result.map_err(absurd);
        }
        if !is_known(&pose.rotation_covariance) {
            // What it says of the attitude cannot be fused linearly.
            let position = GnssPosition {
                position: pose.position,
                covariance: pose.position_covariance,
                lever_arm: Vector3::zeros(),
            };
            let fused = self.filter.update(stream, &position).map_err(absurd)?;
            self.realign(&fused, &position, None)?;
            return Ok(fused);
        }
        let before = self.filter;
        // At the measured attitude, its correction is zero: what is left of the measurement is linear.
        self.filter.set_attitude(&pose.world_from_body, &unknown())?;
        self.filter.hold_attitude(false);
        match self.filter.update(stream, pose) {
            Ok(fused) => {
                self.is_fast = true;
                self.know(Attitude::Doubted);
                Ok(fused)
            }
            Err(refusal) => {
                self.filter = before;
                Err(absurd(refusal))
            }
        }
    }

    fn gnss(
        &mut self,
        position: &GnssPosition,
        velocity: Option<&GnssVelocity>,
        trust: Trust,
    ) -> Result<Fused, Failure> {
        let stream = trusting(&mut self.streams.positions, trust);
        let fused = self.filter.update(stream, position).map_err(absurd)?;
        // A receiver with a good position is trusted even if its velocity is refused.
        let velocity =
            velocity.filter(|velocity| self.filter.update(&mut self.streams.velocities, *velocity).is_ok());
        self.realign(&fused, position, velocity)?;
        self.fits(&fused);
        Ok(fused)
    }

    /// Adds a position that the gate has let in to those that determine the attitude.
    fn realign(
        &mut self,
        fused: &Fused,
        position: &GnssPosition,
        velocity: Option<&GnssVelocity>,
    ) -> Result<(), Failure> {
        if fused.raised > 1.0 && self.is_lost() {
            // Those before disagree.
            self.begin_realignment();
        }
        let Attitude::Lost(Some(realignment)) = &mut self.attitude else { return Ok(()) };
        realignment.position(position);
        if let Some(velocity) = velocity {
            realignment.velocity(velocity);
        }
        match realignment.solve() {
            Ok(Some(realigned)) => self.adopt(&realigned),
            Ok(None) => Ok(()),
            Err(_) => {
                self.begin_realignment();
                Ok(())
            }
        }
    }

    /// Continues from the state that fixes have determined.
    fn adopt(&mut self, realigned: &Realigned) -> Result<(), Failure> {
        let estimate = Estimate {
            position: realigned.position,
            velocity: realigned.velocity,
            world_from_body: realigned.world_from_body,
            accelerometer_bias: realigned.accelerometer_bias,
            gyroscope_bias: realigned.gyroscope_bias,
            ..*self.filter.estimate().ok_or(Refusal::NotStarted)?
        };
        let before = self.filter.covariance();
        let covariance =
            SMatrix::<f64, NAVIGATED, NAVIGATED>::from_fn(|i, j| match (i < NAVIGATION, j < NAVIGATION) {
                (true, true) => realigned.covariance[(i, j)],
                (false, false) => before[(i, j)],
                _ => 0.0,
            });
        // If it cannot be used, the attitude remains lost.
        match self.filter.adopt::<Navigated, NAVIGATED>(&estimate, &covariance) {
            Ok(()) => self.know(Attitude::Known),
            Err(_) => self.begin_realignment(),
        }
        Ok(())
    }

    /// A position was fused.
    fn fits(&mut self, fused: &Fused) {
        if matches!(self.attitude, Attitude::Doubted) && fused.raised <= 1.0 {
            self.attitude = Attitude::Known;
        }
    }

    /// A gap, or a part of one, was bridged.
    fn bridged(&mut self, dt: f64) {
        let (covariance, gap_rotation) = (self.filter.covariance(), self.filter.params().gap_rotation);
        let variance = (ROTATION..ROTATION + 3).map(|i| covariance[(i, i)]).fold(0.0, f64::max);
        let added = gap_rotation * gap_rotation * dt;
        // Earlier gaps count until the attitude is well known again.
        let earlier = if variance - added < WELL * WELL { 0.0 } else { self.by_gaps };
        self.by_gaps = earlier + added;
        // A heading that was never known is not lost in a short gap.
        let is_lost = variance > LOST * LOST && self.by_gaps > 0.5 * LOST * LOST;
        if self.is_lost() || is_lost {
            self.filter.forget_attitude();
            self.filter.hold_attitude(true);
            self.begin_realignment();
        }
    }

    /// The attitude is not what it was believed to be.
    fn lose(&mut self) {
        let Some(attitude) = self.attitude() else { return };
        if self.filter.set_attitude(&attitude, &unknown()).is_ok() {
            self.filter.hold_attitude(true);
            self.begin_realignment();
        }
    }

    /// Time or place are others than those of the fixes so far.
    fn moved(&mut self) {
        if self.is_lost() {
            self.begin_realignment();
        }
    }

    /// Forgets the fixes so far, and begins again.
    fn begin_realignment(&mut self) {
        let begun = |estimate| Realignment::new(estimate, self.filter.covariance(), self.filter.params());
        let begun = self.filter.estimate().and_then(begun);
        match (&mut self.attitude, begun) {
            (Attitude::Lost(Some(realignment)), Some(begun)) => **realignment = begun,
            (attitude, begun) => *attitude = Attitude::Lost(begun.map(Box::new)),
        }
    }

    fn know(&mut self, attitude: Attitude) {
        self.filter.hold_attitude(false);
        (self.attitude, self.by_gaps) = (attitude, 0.0);
    }

    /// Whether the attitude is too uncertain to be corrected.
    pub(super) fn is_lost(&self) -> bool {
        matches!(self.attitude, Attitude::Lost(_))
    }

    /// Whether the attitude is to be trusted.
    pub(super) fn is_attitude_known(&self) -> bool {
        matches!(self.attitude, Attitude::Known)
    }

    /// Whether the keyframe is from before the attitude was lost.
    fn is_keyframe_known(&self) -> bool {
        let Some(first) = offset::<Navigated>(Optional::Keyframe) else { return false };
        let has_keyframe = self.filter.estimate().is_some_and(|estimate| estimate.keyframe.is_some());
        has_keyframe && is_known(&self.filter.covariance().fixed_view::<3, 3>(first + 3, first + 3).into_owned())
    }

    /// Takes an attitude of another source, if it is lost.
    pub(super) fn level(&mut self, world_from_body: &UnitQuaternion<f64>, covariance: &Matrix3<f64>) {
        if self.is_lost() && is_known(covariance) && self.filter.set_attitude(world_from_body, covariance).is_ok() {
            self.is_fast = true;
            self.know(Attitude::Known);
        }
    }

    fn pose(&self) -> Option<Pose> {
        self.filter.estimate().map(|estimate| Pose::of(estimate, self.filter.covariance()))
    }

    pub(super) fn motion(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        self.filter.estimate().map(|estimate| (estimate.position, estimate.velocity))
    }

    pub(super) fn attitude(&self) -> Option<UnitQuaternion<f64>> {
        self.filter.estimate().map(|estimate| estimate.world_from_body)
    }

    pub(super) fn streams(&self) -> &Streams {
        &self.streams
    }

    pub(super) fn gaps(&self) -> u32 {
        self.filter.gaps()
    }

    pub(super) fn predictor(&self) -> Option<Predictor> {
        self.filter.estimate()?;
        Some(Predictor::Copy(self.filter))
    }

    pub(super) fn newest(&self) -> Option<Pose> {
        self.past.back().copied()
    }

    pub(super) fn history(&self, most: usize) -> (Vec<Pose>, bool) {
        (self.past.iter().rev().skip(1).take(most).copied().collect(), false)
    }

    pub(super) fn take_left(&mut self) -> Option<Pose> {
        self.left.take()
    }

    pub(super) fn keyframe_ns(&self) -> i64 {
        self.cadence.keyframe_ns
    }

    pub(super) fn keyframes(&self) -> usize {
        self.past.len()
    }

    pub(super) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) -> Result<(), Refusal> {
        let estimate = Estimate { time_ns, ..*self.filter.estimate().ok_or(Refusal::NotStarted)? };
        let mut covariance = *self.filter.covariance();
        add_time(&mut covariance, &estimate.velocity, deviation_s);
        self.filter.adopt::<Navigated, NAVIGATED>(&estimate, &covariance)?;
        self.begin(time_ns);
        self.moved();
        Ok(())
    }

    pub(super) fn relocate(&mut self, place: &Place) -> Result<(), Refusal> {
        let world_from_body = self.filter.estimate().ok_or(Refusal::NotStarted)?.world_from_body;
        let (antenna, covariance) = place.position;
        let position = (antenna - world_from_body * place.lever_arm, covariance);
        self.filter.relocate(position, place.velocity, None)?;
        self.streams.positions.forgive();
        self.begin(self.filter.estimate().ok_or(Refusal::NotStarted)?.time_ns);
        self.moved();
        Ok(())
    }

    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        self.filter.move_world(new_from_old)?;
        self.moved();
        let turn = new_from_old.rotation.to_rotation_matrix().into_inner();
        for pose in &mut self.past {
            pose.position = new_from_old.transform_point(&pose.position.into()).coords;
            pose.velocity = turn * pose.velocity;
            pose.world_from_body = new_from_old.rotation * pose.world_from_body;
            let mut block = SMatrix::<f64, 6, 6>::zeros();
            [0, 3].iter().for_each(|first| block.fixed_view_mut::<3, 3>(*first, *first).copy_from(&turn));
            pose.covariance = block * pose.covariance * block.transpose();
        }
        Ok(())
    }
}

/// Whether an attitude of this covariance can be corrected linearly.
fn is_known(covariance: &Matrix3<f64>) -> bool {
    covariance.trace() < KNOWN * KNOWN
}

/// The covariance of an attitude of which nothing is known.
fn unknown() -> Matrix3<f64> {
    Matrix3::identity() * (UNKNOWN * UNKNOWN)
}

/// A correction that would move the filter farther than any distance on the Earth is fatal, as it is for the smoother.
fn absurd(refusal: Refusal) -> Failure {
    match refusal {
        Refusal::OutOfRange => Failure::Fatal(refusal),
        _ => Failure::Refused(refusal),
    }
}

/// Fuses a factor that involves only the present state.
fn update<F: ProvidedFactor>(
    filter: &mut Eskf<Navigated, NAVIGATED>,
    stream: &mut Stream,
    factor: &F,
) -> Result<Fused, Failure> {
    if let Some(id) = Factor::<Navigated, NAVIGATED>::previous(factor) {
        return Err(Refusal::NoKeyframe { id }.into());
    }
    let at = filter.estimate().ok_or(Refusal::NotStarted)?;
    let mut rows = Rows::new();
    rows.fill(false, |rows| Factor::<Navigated, NAVIGATED>::linearise(factor, None, at, rows))?;
    let (residual, jacobian) = rows.alone();
    macro_rules! of_dimension {
        ($($dimension:literal)*) => {
            match residual.len() {
                $($dimension => {
                    filter.update(stream, &Whitened::<$dimension>::new(residual, jacobian)).map_err(absurd)
                })*
                _ => Err(Refusal::NotObservable.into()),
            }
        };
    }
    of_dimension!(1 2 3 4 5 6 7 8 9)
}

/// A factor linearised at the filter's estimate, with unit noise.
struct Whitened<const D: usize> {
    residual: [f64; D],
    jacobian: [[f64; NAVIGATED]; D],
}

impl<const D: usize> Whitened<D> {
    fn new(residual: &[f64], jacobian: &[[f64; NAVIGATED]]) -> Self {
        let at = |i: usize| residual.get(i).copied().unwrap_or(0.0);
        let row = |i: usize| jacobian.get(i).copied().unwrap_or([0.0; NAVIGATED]);
        Self { residual: core::array::from_fn(at), jacobian: core::array::from_fn(row) }
    }
}

/// A relative pose linearised at another estimate, for the filter's.
struct Relinearised(Linearised<6, NAVIGATED>);

impl Relinearised {
    fn new(pose: &RelativePose, estimate: &Estimate<NAVIGATED>, at: &Estimate<NAVIGATED>) -> Result<Self, Refusal> {
        let mut model = Linearised::new();
        pose.linearise::<Navigated, NAVIGATED>(at, &mut model)?;
        let error = estimate.error_to::<Navigated>(at);
        for (residual, row) in model.residual.iter_mut().zip(&model.jacobian) {
            *residual += row.iter().zip(&error).map(|(derivative, error)| derivative * error).sum::<f64>();
        }
        Ok(Self(model))
    }
}

impl Measurement<6> for Relinearised {
    fn linearise<S: States, const N: usize>(
        &self,
        _: &Estimate<N>,
        model: &mut Linearised<6, N>,
    ) -> Result<(), Refusal> {
        (model.residual, model.noise) = (self.0.residual, self.0.noise);
        for (row, from) in model.jacobian.iter_mut().zip(&self.0.jacobian) {
            row.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        Ok(())
    }
}

impl<const D: usize> Measurement<D> for Whitened<D> {
    fn linearise<S: States, const N: usize>(
        &self,
        _: &Estimate<N>,
        model: &mut Linearised<D, N>,
    ) -> Result<(), Refusal> {
        model.residual = self.residual;
        for (row, from) in model.jacobian.iter_mut().zip(&self.jacobian) {
            row.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        model.noise = SMatrix::identity();
        Ok(())
    }
}
