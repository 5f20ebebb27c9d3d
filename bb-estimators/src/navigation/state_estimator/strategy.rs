//! The filter, as [copies](crate::navigation::Copies) of which the best is the estimate, with or without a window that follows it.

mod metric;
mod predictor;
mod provided;
#[cfg_attr(not(feature = "smoother"), path = "strategy/no_window.rs")]
mod window;

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::{Isometry3, Matrix6, SMatrix, UnitQuaternion, Vector3};

use self::metric::Metric;
pub(super) use self::predictor::Predictor;
use self::window::Window;
use super::error::EstimatorError;
use super::factor::ProvidedFactor;
use super::given::PoseRows;
pub(super) use super::ids::id_of;
use super::input::Feature;
use super::params::{StateEstimatorConfig, ns};
use crate::attitude::ParamsError;
use crate::navigation::copies::{Copies, Ways};
use crate::navigation::eskf::{EskfFilter, ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity, RelativePose};
use crate::navigation::numbers::{CAMERA_SLACK_NS, UNKNOWN_HEADING};
use crate::navigation::propagate::Propagate as _;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::{Estimate, NAVIGATED, Navigated, POSITION, ROTATION};
use crate::navigation::stream::{Stream, StreamParams};

/// A pose in the world of the engine, and its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    pub(super) time_ns: i64,
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) world_from_body: UnitQuaternion<f64>,
    /// Position error, then rotation error.
    pub(super) covariance: Matrix6<f64>,
}

impl Pose {
    fn of<const N: usize>(estimate: &Estimate<N>, covariance: &SMatrix<f64, N, N>) -> Self {
        let index = |i: usize| if i < 3 { POSITION + i } else { ROTATION + i - 3 };
        let Estimate { time_ns, position, velocity, world_from_body, .. } = *estimate;
        let covariance = Matrix6::from_fn(|i, j| covariance[(index(i), index(j))]);
        Self { time_ns, position, velocity, world_from_body, covariance }
    }

    pub(super) fn is_finite(&self) -> bool {
        let vectors = [&self.position, &self.velocity];
        vectors.iter().all(|vector| vector.iter().all(|x| x.is_finite()))
            && self.world_from_body.coords.iter().all(|x| x.is_finite())
            && self.covariance.iter().all(|x| x.is_finite())
            && self.covariance.diagonal().iter().all(|x| *x > 0.0)
    }
}

/// A measurement, in the world of the engine.
#[derive(Clone, Copy, Debug)]
pub(super) enum Measured<'a, F> {
    Relative(RelativePose),
    Anchor(AbsolutePose),
    Gnss(GnssPosition, Option<GnssVelocity>, Trust),
    Provided(&'a F),
    Linear(&'a PoseRows),
    /// A relative pose of a provider, whose scale is known.
    Between(RelativePose),
    /// The landmarks in the image of the newest keyframe.
    Features(&'a [Feature]),
}

/// Permission of a fix that does not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    /// None: it is refused.
    Doubted,
    /// The position may show that the estimate is in the wrong place.
    Believed,
}

/// A gate per kind of measurement.
#[derive(Clone, Copy, Debug)]
pub(super) struct Streams {
    pub(super) relative: Stream,
    pub(super) anchors: Stream,
    pub(super) positions: Stream,
    pub(super) velocities: Stream,
    pub(super) provided: Stream,
}

impl Streams {
    fn new() -> Self {
        let stream = Stream::default();
        // Positions have the gate of the copies.
        let open = Stream::new(StreamParams { gate: 0.0, ..*stream.params() });
        Self { relative: stream, anchors: open, positions: open, velocities: stream, provided: stream }
    }
}

/// Timing of keyframes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cadence {
    interval_ns: i64,
    keyframe_ns: i64,
    camera_ns: i64,
    /// Time between the last two frames of the camera.
    spacing_ns: i64,
}

impl Cadence {
    fn new(config: &StateEstimatorConfig) -> Self {
        let interval_ns = ns(config.params.keyframe_interval);
        Self { interval_ns, keyframe_ns: i64::MIN, camera_ns: i64::MIN, spacing_ns: 0 }
    }

    /// Starts at a time, which counts as a frame.
    fn begin(&mut self, time_ns: i64) {
        (self.keyframe_ns, self.camera_ns) = (time_ns, time_ns);
    }

    /// The newest keyframe is a frame of the camera.
    fn camera_frame(&mut self) {
        if self.keyframe_ns > self.camera_ns {
            self.spacing_ns = self.keyframe_ns.saturating_sub(self.camera_ns);
            self.camera_ns = self.keyframe_ns;
        }
    }

    /// Returns the time to wait for the next frame: a keyframe between two frames would separate them.
    fn patience_ns(&self) -> i64 {
        (self.spacing_ns / 2).saturating_mul(3).min(self.interval_ns.saturating_add(CAMERA_SLACK_NS))
    }

    fn awaits_camera(&self, now_ns: i64, at_least_ns: i64) -> bool {
        now_ns.saturating_sub(self.camera_ns) <= self.patience_ns().max(at_least_ns)
    }

    /// Returns whether a keyframe is due without a camera.
    fn is_due(&self, now_ns: i64) -> bool {
        now_ns.saturating_sub(self.keyframe_ns) >= self.interval_ns && !self.awaits_camera(now_ns, 0)
    }

    /// Returns whether the camera determines the times of keyframes.
    fn has_camera(&self, now_ns: i64) -> bool {
        self.awaits_camera(now_ns, self.interval_ns / 2)
    }
}

/// The copies of the filter, and the poses of the last keyframes: the window's, if there is one.
#[derive(Clone, Debug)]
pub(super) struct Strategy<F: ProvidedFactor> {
    copies: Copies<EskfFilter<Navigated, NAVIGATED>>,
    streams: Streams,
    cadence: Cadence,
    /// `None` if the filter is the whole strategy.
    window: Option<Box<Window<F>>>,
    /// Estimates of the filter at the last keyframes, the newest last. They are never corrected.
    past: VecDeque<Pose>,
    /// The most of them.
    most: usize,
    /// `true` to keep each keyframe that leaves for [`Self::take_left`].
    records: bool,
    left: Option<Pose>,
    /// `true` if the present becomes the reference of the next relative pose, once all measurements at this time are fused.
    is_reference_due: bool,
    /// Time of the last relative pose of a camera that the filter has fused.
    related_ns: i64,
}

impl<F: ProvidedFactor> Strategy<F> {
    /// Creates a strategy that has not started.
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        let most = config.params.window as usize;
        let has_window = config.strategy.is_smoothing();
        Ok(Self {
            copies: Copies::new(config.sensors, Ways { noise: true, scale: true })?,
            streams: Streams::new(),
            cadence: Cadence::new(config),
            window: has_window.then(|| Window::new(config).map(Box::new)).transpose()?,
            past: VecDeque::with_capacity(most + 1),
            most,
            records: config.params.record_keyframes,
            left: None,
            is_reference_due: false,
            related_ns: i64::MIN,
        })
    }

    /// Starts or restarts.
    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.copies.start(start)?;
        self.begin(start.time_ns);
        // Earlier refusals relate to another estimate.
        self.streams.anchors.forgive();
        self.window.as_mut().map_or(Ok(()), |window| window.start(start, &self.copies))
    }

    /// Makes the present state the first keyframe.
    fn begin(&mut self, time_ns: i64) {
        self.copies.set_keyframe(id_of(time_ns));
        self.cadence.begin(time_ns);
        self.is_reference_due = false;
        self.related_ns = i64::MIN;
        self.past.clear();
        self.past.extend(self.pose());
    }

    /// Advances to a time within one sample, which began at `since_ns`. Makes a keyframe if one is due.
    pub(super) fn propagate(
        &mut self,
        until_ns: i64,
        sample: &ImuMean,
        since_ns: i64,
    ) -> Result<(), EstimatorError> {
        if let Some(window) = &mut self.window {
            let held = self.copies.held(until_ns, sample, since_ns)?;
            window.propagate(&ImuMean { time_ns: until_ns, ..*sample }, held)?;
        }
        if core::mem::take(&mut self.is_reference_due) {
            self.copies.set_keyframe(id_of(self.cadence.camera_ns));
        }
        self.copies.propagate_until(until_ns, sample, since_ns)?;
        if self.cadence.is_due(until_ns) {
            self.keep()?;
        }
        self.follow()
    }

    /// Makes the present state a keyframe: a camera has captured a frame.
    pub(super) fn frame(&mut self) -> Result<(), EstimatorError> {
        self.keep()?;
        self.cadence.camera_frame();
        self.is_reference_due = true;
        self.follow()
    }

    /// Makes the present a keyframe.
    fn keyframe(&mut self) -> Result<(), EstimatorError> {
        self.keep()?;
        self.follow()
    }

    /// Makes the present a keyframe of the filter.
    fn keep(&mut self) -> Result<(), EstimatorError> {
        let pose = self.pose().ok_or(Refusal::NotStarted)?;
        if pose.time_ns == self.cadence.keyframe_ns {
            return Ok(());
        }
        if !pose.is_finite() {
            return Err(EstimatorError::fatal(Refusal::NonFinite));
        }
        self.cadence.keyframe_ns = pose.time_ns;
        self.past.push_back(pose);
        if self.past.len() > self.most {
            self.left = self.past.pop_front().filter(|_| self.records);
        }
        Ok(())
    }

    /// Makes the newest keyframe of the filter one of the window.
    fn follow(&mut self) -> Result<(), EstimatorError> {
        self.window.as_mut().map_or(Ok(()), |window| window.follow(self.cadence.keyframe_ns))
    }

    /// Restarts the window in the state of the filter.
    fn restart_window(&mut self, is_converged: bool) -> Result<(), EstimatorError> {
        self.window.as_mut().map_or(Ok(()), |window| window.restart(&self.copies, is_converged))?;
        self.keep()
    }

    /// The window, if there is one, once the present is its newest keyframe: otherwise samples since then would be lost.
    fn window_at_present(&mut self) -> Result<Option<&mut Window<F>>, EstimatorError> {
        if self.window.is_some() {
            self.keyframe()?;
        }
        Ok(self.window.as_deref_mut())
    }

    /// Fuses a measurement at the present time.
    pub(super) fn measure(&mut self, measured: &Measured<'_, F>) -> Result<Fused, EstimatorError> {
        if self.window.is_none() {
            return self.fuse(measured);
        }
        if let Measured::Features(features) = measured {
            return self.observe(features);
        }
        // Without a camera, nothing else determines the times of keyframes. The dependence of a provider's factor on the present state is
        // unknown, so it cannot be carried back.
        let has_camera = self.copies.estimate().is_some_and(|now| self.cadence.has_camera(now.time_ns));
        let is_provided = matches!(measured, Measured::Provided(_) | Measured::Linear(_) | Measured::Between(_));
        if !has_camera || is_provided {
            self.keyframe()?;
        }
        let related = match measured {
            Measured::Relative(pose) | Measured::Between(pose) => Some(pose),
            _ => None,
        };
        if let Some(pose) = related.filter(|pose| !self.refers_to(pose.keyframe)) {
            return self.relate(measured, pose);
        }
        let resets = self.resets();
        let fused = self.fuse(measured);
        // A relative pose ends where the next one begins: in between, the window would lose one.
        let is_between = has_camera && !matches!(measured, Measured::Relative(_));
        let has_moved = self.resets() != resets;
        let is_fatal = matches!(fused, Err(EstimatorError::Fatal(_)));
        let Some(window) = &mut self.window else { return fused };
        // A window that was restarted may not have the keyframe any more that the filter holds.
        let is_gone = fused.is_ok() && related.is_some_and(|pose| !window.has(pose.keyframe));
        if (!window.fits(&self.copies) && !is_between || has_moved || is_gone) && !is_fatal {
            self.restart_window(true)?;
            return fused;
        }
        let fused = fused?;
        let has_velocity = self.streams.velocities.counts().gate_in_a_row == 0;
        window.add(measured, id_of(self.cadence.keyframe_ns), &self.copies, has_velocity)?;
        if !window.is_converged() && !is_between {
            self.restart_window(false)?;
        }
        Ok(fused)
    }

    /// Adds a relative pose to a keyframe that the filter does not hold. The window judges it itself, and has it as long as it is not
    /// restarted in the state of the filter.
    fn relate(&mut self, measured: &Measured<'_, F>, pose: &RelativePose) -> Result<Fused, EstimatorError> {
        let Some(window) = &mut self.window else { return Err(Refusal::NoKeyframe { id: pose.keyframe }.into()) };
        let fused = window.relate(measured, id_of(self.cadence.keyframe_ns), pose)?;
        if !window.is_converged() {
            self.restart_window(false)?;
        }
        Ok(fused)
    }

    /// Adds the landmarks of an image to the window. What the window then knows of the motion since the last frame is the filter's
    /// visual odometry, which keeps its gates as narrow as the estimate. A filter that has a relative pose to this frame needs no other:
    /// the window's rests on it too.
    fn observe(&mut self, features: &[Feature]) -> Result<Fused, EstimatorError> {
        self.keyframe()?;
        let now = id_of(self.cadence.keyframe_ns);
        let Some(window) = &mut self.window else { return Err(Refusal::NotObservable.into()) };
        let seen = window.observe(now, features)?;
        if !window.is_converged() {
            self.restart_window(false)?;
            return Ok(seen);
        }
        let reference = self.copies.estimate().and_then(|estimate| estimate.keyframe);
        let needs_motion = seen.dimension > 0 && self.related_ns != self.cadence.keyframe_ns;
        let motion = reference.filter(|_| needs_motion).and_then(|held| window.motion(held.id, now));
        if let Some(motion) = motion {
            // One that the filter refuses is no fault of the image.
            let fused = self.fuse(&Measured::Between(motion));
            let fits = self.window.as_ref().is_none_or(|window| window.fits(&self.copies));
            match fused {
                Err(EstimatorError::Fatal(reason)) => return Err(EstimatorError::Fatal(reason)),
                _ if !fits => self.restart_window(true)?,
                _ => {}
            }
        }
        Ok(seen)
    }

    /// Returns whether this keyframe is the one that relative poses to the filter refer to.
    fn refers_to(&self, keyframe: u64) -> bool {
        let estimate = self.copies.estimate();
        estimate.and_then(|estimate| estimate.keyframe).is_some_and(|held| held.id == keyframe)
    }

    /// Fuses a measurement with the filter.
    fn fuse(&mut self, measured: &Measured<'_, F>) -> Result<Fused, EstimatorError> {
        let Self { copies, streams, related_ns, cadence, .. } = self;
        let fused = match measured {
            Measured::Relative(pose) => {
                let fused = copies.update(&mut streams.relative, pose).map_err(escalate)?;
                *related_ns = cadence.keyframe_ns;
                fused
            }
            Measured::Anchor(pose) => copies.update_position(&mut streams.anchors, pose).map_err(escalate)?,
            Measured::Gnss(position, velocity, trust) => {
                let fused = match trust {
                    Trust::Doubted => copies.update_doubted_fix(&mut streams.positions, position),
                    Trust::Believed => copies.update_fix(&mut streams.positions, position),
                }
                .map_err(escalate)?;
                // A receiver with a good position is trusted even if its velocity is refused.
                if let Some(velocity) = velocity {
                    let _ = copies.update(&mut streams.velocities, velocity);
                }
                fused
            }
            Measured::Between(pose) => copies.update(&mut streams.provided, &Metric(pose)).map_err(escalate)?,
            Measured::Linear(rows) => provided::update(copies, &mut streams.provided, *rows)?,
            Measured::Provided(factor) => provided::update(copies, &mut streams.provided, *factor)?,
            Measured::Features(_) => return Err(Refusal::NotObservable.into()),
        };
        let pose = self.pose().filter(Pose::is_finite).ok_or(EstimatorError::fatal(Refusal::NonFinite))?;
        if let Some(newest) = self.past.back_mut().filter(|newest| newest.time_ns == pose.time_ns) {
            *newest = pose;
        }
        Ok(fused)
    }

    fn pose(&self) -> Option<Pose> {
        let best = self.copies.best();
        best.estimate().map(|estimate| Pose::of(estimate, best.covariance()))
    }

    /// Returns whether the last correction has converged. If not, the covariance is not to be trusted. The filter corrects in a fixed
    /// number of steps.
    pub(super) fn is_converged(&self) -> bool {
        self.window.as_ref().is_none_or(|window| window.is_converged())
    }

    /// Returns whether the attitude is known well enough to be corrected linearly. After an outage of the IMU it is not, until it has
    /// been determined again.
    pub(super) fn is_attitude_known(&self) -> bool {
        self.copies.attitude_deviation() <= UNKNOWN_HEADING
    }

    /// Present position and velocity.
    pub(super) fn motion(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        self.present(|position, velocity, _| (*position, *velocity))
    }

    /// The attitude at the present time.
    pub(super) fn attitude(&self) -> Option<UnitQuaternion<f64>> {
        self.present(|_, _, attitude| *attitude)
    }

    fn present<T>(&self, of: impl FnOnce(&Vector3<f64>, &Vector3<f64>, &UnitQuaternion<f64>) -> T) -> Option<T> {
        match &self.window {
            Some(window) => window.predicted().map(|now| of(&now.position, &now.velocity, &now.world_from_body)),
            None => self.copies.estimate().map(|now| of(&now.position, &now.velocity, &now.world_from_body)),
        }
    }

    /// Number of gaps in the IMU samples that were bridged.
    pub(super) fn gaps(&self) -> u32 {
        self.copies.best().gaps()
    }

    /// The predictor from the newest estimate, if there is one.
    pub(super) fn predictor(&self) -> Option<Predictor> {
        let filter = match &self.window {
            Some(window) => window.filter(self.copies.noise())?,
            None => *self.copies.best(),
        };
        filter.estimate()?;
        Some(Predictor { filter, holding: *self.copies.holding() })
    }

    /// The newest keyframe.
    pub(super) fn newest(&self) -> Option<Pose> {
        self.window.as_ref().map_or_else(|| self.past.back().copied(), |window| window.newest())
    }

    /// Keyframes before the newest, in reverse order of time, and whether they are smoothed.
    pub(super) fn history(&mut self, most: usize) -> (Vec<Pose>, bool) {
        match &mut self.window {
            Some(window) => (window.history(most), true),
            None => (self.past.iter().rev().skip(1).take(most).copied().collect(), false),
        }
    }

    /// The next of the keyframes that have left, if any.
    pub(super) fn take_left(&mut self) -> Option<Pose> {
        self.window.as_mut().map_or_else(|| self.left.take(), |window| window.take_left())
    }

    /// Time of the newest keyframe, ns.
    pub(super) fn keyframe_ns(&self) -> i64 {
        self.cadence.keyframe_ns
    }

    /// Number of keyframes held.
    pub(super) fn keyframes(&self) -> usize {
        self.window.as_ref().map_or(self.past.len(), |window| window.keyframes())
    }

    /// The gates, with what each has refused.
    pub(super) fn streams(&self) -> &Streams {
        &self.streams
    }

    /// Number of starts and of newcomers that took over.
    pub(super) fn resets(&self) -> u32 {
        self.copies.best().resets()
    }

    /// Assigns a new time to the present state, with the standard deviation of that time, s. Keyframes are dropped.
    pub(super) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) -> Result<(), EstimatorError> {
        if let Some(window) = self.window_at_present()? {
            window.set_clock(time_ns, deviation_s)?;
        }
        self.copies.set_clock(time_ns, deviation_s);
        self.begin(time_ns);
        Ok(())
    }

    /// Moves to another world.
    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), EstimatorError> {
        if let Some(window) = self.window_at_present()? {
            window.move_world(new_from_old)?;
        }
        self.copies.move_world(new_from_old)?;
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

/// Makes a correction that would move the filter farther than any distance on the Earth fatal, as it is for the window.
fn escalate(refusal: Refusal) -> EstimatorError {
    match refusal {
        Refusal::OutOfRange => EstimatorError::fatal(refusal),
        _ => refusal.into(),
    }
}
