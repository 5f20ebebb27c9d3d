//! The error-state Kalman filter: [copies](crate::navigation::Copies) of it, of which the best is the estimate.

mod factor;

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector3};

use super::{Cadence, Measured, Pose, Predictor, Streams, Trust, id_of};
use crate::attitude::ParamsError;
use crate::navigation::copies::{Copies, Ways};
use crate::navigation::eskf::{EskfFilter, ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::numbers::UNKNOWN_HEADING;
use crate::navigation::propagate::Propagate as _;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::Estimate;
use crate::navigation::state::{NAVIGATED, Navigated};
use crate::navigation::state_estimator::error::EstimatorError;
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::params::StateEstimatorConfig;

/// The copies of the filter, and the poses of the last keyframes.
#[derive(Clone, Debug)]
pub(in crate::navigation::state_estimator) struct EskfStrategy {
    copies: Copies<EskfFilter<Navigated, NAVIGATED>>,
    streams: Streams,
    cadence: Cadence,
    /// Estimates at the last keyframes, the newest last. They are never corrected.
    past: VecDeque<Pose>,
    window: usize,
    /// `true` to keep each keyframe that leaves the window for [`Self::take_left`].
    records: bool,
    left: Option<Pose>,
    /// `true` if the present becomes the reference of the next relative pose, once all measurements at this time are fused.
    is_reference_due: bool,
}

impl EskfStrategy {
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        let window = config.params.window as usize;
        Ok(Self {
            copies: Copies::new(config.sensors, Ways { noise: true, scale: true })?,
            streams: Streams::new(),
            cadence: Cadence::new(config),
            past: VecDeque::with_capacity(window + 1),
            window,
            records: config.params.record_keyframes,
            left: None,
            is_reference_due: false,
        })
    }

    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.copies.start(start)?;
        self.begin(start.time_ns);
        // Earlier refusals relate to another estimate.
        self.streams.anchors.forgive();
        Ok(())
    }

    /// Makes the present state the first keyframe.
    fn begin(&mut self, time_ns: i64) {
        self.copies.set_keyframe(id_of(time_ns));
        self.cadence.begin(time_ns);
        self.is_reference_due = false;
        self.past.clear();
        self.past.extend(self.pose());
    }

    pub(super) fn propagate(
        &mut self,
        until_ns: i64,
        sample: &ImuMean,
        since_ns: i64,
    ) -> Result<(), EstimatorError> {
        if core::mem::take(&mut self.is_reference_due) {
            self.copies.set_keyframe(id_of(self.cadence.camera_ns));
        }
        self.copies.propagate_until(until_ns, sample, since_ns)?;
        if self.cadence.is_due(until_ns) { self.keyframe() } else { Ok(()) }
    }

    pub(super) fn camera_frame(&mut self) -> Result<(), EstimatorError> {
        self.keyframe()?;
        self.cadence.camera_frame();
        self.is_reference_due = true;
        Ok(())
    }

    /// Makes the present a keyframe.
    pub(super) fn keyframe(&mut self) -> Result<(), EstimatorError> {
        let pose = self.pose().ok_or(Refusal::NotStarted)?;
        if pose.time_ns == self.cadence.keyframe_ns {
            return Ok(());
        }
        if !pose.is_finite() {
            return Err(EstimatorError::fatal(Refusal::NonFinite));
        }
        self.cadence.keyframe_ns = pose.time_ns;
        self.past.push_back(pose);
        if self.past.len() > self.window {
            self.left = self.past.pop_front().filter(|_| self.records);
        }
        Ok(())
    }

    pub(super) fn measure<F: ProvidedFactor>(
        &mut self,
        measured: &Measured<'_, F>,
    ) -> Result<Fused, EstimatorError> {
        let Self { copies, streams, .. } = self;
        let result = match measured {
            Measured::Relative(pose) => copies.update(&mut streams.relative, pose),
            Measured::Anchor(pose) => copies.update_position(&mut streams.anchors, pose),
            Measured::Gnss(position, velocity, trust) => {
                let result = match trust {
                    Trust::Doubted => copies.update_doubted_fix(&mut streams.positions, position),
                    Trust::Believed => copies.update_fix(&mut streams.positions, position),
                };
                // A receiver with a good position is trusted even if its velocity is refused.
                if let (Ok(_), Some(velocity)) = (&result, velocity) {
                    let _ = copies.update(&mut streams.velocities, velocity);
                }
                result
            }
            Measured::Provided(factor) => {
                return factor::update(copies, &mut streams.provided, *factor).and_then(|fused| self.keep(fused));
            }
        };
        self.keep(result.map_err(escalate)?)
    }

    /// Checks the estimate after a fusion, and updates the newest keyframe if the measurement was at its time.
    fn keep(&mut self, fused: Fused) -> Result<Fused, EstimatorError> {
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

    /// The copies of the filter.
    pub(super) fn copies(&self) -> &Copies<EskfFilter<Navigated, NAVIGATED>> {
        &self.copies
    }

    /// Returns whether the velocity of the last fix that had one was fused.
    pub(super) fn has_fused_velocity(&self) -> bool {
        self.streams.velocities.counts().gate_in_a_row == 0
    }

    /// Returns whether the camera determines the times of keyframes.
    pub(super) fn has_camera(&self) -> bool {
        self.copies.estimate().is_some_and(|now| self.cadence.has_camera(now.time_ns))
    }

    /// The present state and its covariance.
    pub(super) fn state(&self) -> Option<(&Estimate<NAVIGATED>, &SMatrix<f64, NAVIGATED, NAVIGATED>)> {
        let best = self.copies.best();
        best.estimate().map(|estimate| (estimate, best.covariance()))
    }

    pub(super) fn motion(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        self.copies.estimate().map(|estimate| (estimate.position, estimate.velocity))
    }

    pub(super) fn attitude(&self) -> Option<UnitQuaternion<f64>> {
        self.copies.estimate().map(|estimate| estimate.world_from_body)
    }

    pub(super) fn streams(&self) -> &Streams {
        &self.streams
    }

    pub(super) fn gaps(&self) -> u32 {
        self.copies.best().gaps()
    }

    pub(super) fn predictor(&self) -> Option<Predictor> {
        self.copies.estimate()?;
        Some(Predictor::of(self.copies.best()))
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

    /// Number of starts and of newcomers that took over.
    pub(super) fn resets(&self) -> u32 {
        self.copies.best().resets()
    }

    /// The filter corrects in a fixed number of steps.
    pub(super) fn is_converged(&self) -> bool {
        true
    }

    /// Returns whether the attitude is known well enough to be corrected linearly.
    pub(super) fn is_attitude_known(&self) -> bool {
        self.copies.attitude_deviation() <= UNKNOWN_HEADING
    }

    pub(super) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) -> Result<(), EstimatorError> {
        self.copies.set_clock(time_ns, deviation_s);
        self.begin(time_ns);
        Ok(())
    }

    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), EstimatorError> {
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

/// Makes a correction that would move the filter farther than any distance on the Earth fatal, as it is for the smoother.
fn escalate(refusal: Refusal) -> EstimatorError {
    match refusal {
        Refusal::OutOfRange => EstimatorError::fatal(refusal),
        _ => refusal.into(),
    }
}
