//! The error-state Kalman filter.
//!
//! # After an outage of the IMU
//!
//! A filter corrects the attitude linearly. A gap of more than half a second leaves it too uncertain for that: it is *lost* until
//! something determines it as a whole,
//!
//! * an anchor or an attitude of the flight controller, which is in doubt until another one fits, or fixes do for some seconds: a
//!   position says little of an attitude that is wrong,
//! * a relative pose that begins before the gap,
//! * fixes, by the motion that the IMU has measured since the gap, see `navigation/realignment.rs`,
//! * or a restart.
//!
//! Meanwhile the body is assumed to keep its velocity, as in a gap, and measurements correct position and velocity alone: what the
//! accelerometer measures has no direction in the world. Their covariance is right, so the gates judge as they should. Relative poses
//! between frames since the gap are refused: they begin at a pose of unknown attitude.
//! A lost or doubtful attitude makes the estimate degraded. Without a horizontal acceleration, fixes do not show the heading, and it
//! remains so.

mod factor;
mod fused;
mod lost;

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector3};

use super::{Cadence, Failure, Measured, Place, Pose, Predictor, Streams, add_time, id_of};
use crate::attitude::ParamsError;
use crate::navigation::eskf::{Eskf, ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::realignment::Realignment;
use crate::navigation::refusal::Refusal;
use crate::navigation::state::Estimate;
use crate::navigation::state::{NAVIGATED, Navigated};
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::params::StateEstimatorConfig;

/// Whether the attitude is known well enough to be corrected.
#[derive(Clone, Debug)]
enum Attitude {
    Known,
    /// From a single anchor, or from the flight controller: what follows has to fit.
    Doubted {
        /// The time since which nothing was refused, ns.
        since_ns: i64,
        /// What fixes say of it, without it.
        realignment: Option<Box<Realignment>>,
    },
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
    /// The end of the last gap, and the variance of the rotation that it may have hidden, rad².
    gap: (i64, f64),
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
            gap: (i64::MIN, 0.0),
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
        } else if let Some(realignment) = self.realignment() {
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
            Measured::Provided(factor) => factor::update(&mut self.filter, &mut self.streams.provided, *factor)?,
        };
        let pose = self.pose().filter(Pose::is_finite).ok_or(Failure::Fatal(Refusal::NonFinite))?;
        // A measurement at a keyframe belongs to that keyframe.
        if let Some(newest) = self.past.back_mut().filter(|newest| newest.time_ns == pose.time_ns) {
            *newest = pose;
        }
        Ok(fused)
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
