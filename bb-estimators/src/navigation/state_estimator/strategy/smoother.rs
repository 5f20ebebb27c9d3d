//! The fixed-lag smoother, beside the filter.
//!
//! The [filter](super::eskf) runs with the same inputs. It decides what is fused, finds the noise of the IMU and of fixes and whether the
//! scale of relative poses drifts, and moves to where positions agree. Whenever another of its copies becomes the best, the window restarts
//! in that copy's state, with its noise: what it has concluded with another noise is more or less certain than its covariance says. It
//! restarts there as well when an update does not converge: what leaves it would be linearised in the wrong place for good.
//!
//! Keyframes are the frames of the camera. Without a camera, they are made at intervals, and at measurements. A measurement between
//! two keyframes is carried back to the earlier one by the motion since then.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::{Isometry3, Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::eskf::EskfStrategy;
use super::{Measured, Pose, Predictor, Streams, add_time, id_of};
use crate::attitude::ParamsError;
use crate::navigation::eskf::{EskfFilter, ImuMean, Start, seconds_between};
use crate::navigation::factor::{Factor, NavigationFactor, Rows};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity};
use crate::navigation::refusal::Refusal;
use crate::navigation::smoother::{FixedLagSmoother, SmootherParams};
use crate::navigation::state::{Estimate, NAVIGATED, Navigated, Optional, POSITION, ROTATION, States, VELOCITY};
use crate::navigation::state_estimator::error::EstimatorError;
use crate::navigation::state_estimator::factor::{ProvidedFactor, SMOOTHED, Smoothed};
use crate::navigation::state_estimator::params::StateEstimatorConfig;
use crate::navigation::stream::{Stream, StreamParams};

#[expect(clippy::large_enum_variant, reason = "factors of providers are as large as theirs are")]
/// A factor in the window: of this crate, or of a provider.
#[derive(Clone, Copy, Debug)]
pub(super) enum Held<F> {
    Navigation(NavigationFactor),
    Provided(F),
}

impl<S: States, const N: usize, F: Factor<S, N>> Factor<S, N> for Held<F> {
    fn previous(&self) -> Option<u64> {
        match self {
            Self::Navigation(factor) => Factor::<S, N>::previous(factor),
            Self::Provided(factor) => factor.previous(),
        }
    }

    fn linearise(
        &self,
        previous: Option<&Estimate<N>>,
        at: &Estimate<N>,
        rows: &mut Rows<N>,
    ) -> Result<(), Refusal> {
        match self {
            Self::Navigation(factor) => Factor::<S, N>::linearise(factor, previous, at, rows),
            Self::Provided(factor) => factor.linearise(previous, at, rows),
        }
    }
}

/// The window, and the filter beside it.
#[derive(Clone, Debug)]
pub(in crate::navigation::state_estimator) struct SmootherStrategy<F: ProvidedFactor> {
    smoother: FixedLagSmoother<Smoothed, SMOOTHED, Held<F>>,
    filter: EskfStrategy,
    /// The changes of the best copy that the window has followed.
    changes: u32,
    /// A stream without a gate, for measurements that the filter has fused.
    open: Stream,
    records: bool,
    left: VecDeque<Pose>,
    /// `false` if the last update of the window did not converge.
    is_converged: bool,
}

/// Motion from the newest keyframe to the present.
struct Way {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Rotates body coordinates at the keyframe to those at present.
    now_from_keyframe: UnitQuaternion<f64>,
    /// Covariance of that position.
    covariance: Matrix3<f64>,
}

impl<F: ProvidedFactor> SmootherStrategy<F> {
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        let window = config.params.window as usize;
        let params = SmootherParams { sensors: config.sensors, window, ..SmootherParams::default() };
        Ok(Self {
            smoother: FixedLagSmoother::new(params)?,
            filter: EskfStrategy::new(config)?,
            changes: 0,
            open: Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() }),
            records: config.params.record_keyframes,
            left: VecDeque::new(),
            is_converged: true,
        })
    }

    pub(super) fn is_converged(&self) -> bool {
        self.is_converged
    }

    /// The window follows the filter.
    pub(super) fn is_attitude_known(&self) -> bool {
        self.filter.is_attitude_known()
    }

    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.filter.start(start)?;
        self.tune();
        self.changes = self.filter.copies().changes();
        self.smoother.start(id_of(start.time_ns), start)?;
        self.is_converged = true;
        Ok(())
    }

    /// Gives the window what the filter has found: the noise of the IMU, and whether the scale of relative poses drifts.
    fn tune(&mut self) {
        self.smoother.set_noise(self.filter.copies().noise());
        self.smoother.set_relative_scale(self.filter.copies().best().params().relative_scale);
    }

    /// Returns how often it started, or went on in another place.
    pub(super) fn resets(&self) -> u32 {
        self.filter.resets()
    }

    pub(super) fn propagate(
        &mut self,
        until_ns: i64,
        sample: &ImuMean,
        since_ns: i64,
    ) -> Result<(), EstimatorError> {
        match self.filter.copies().held(until_ns, sample, since_ns)? {
            Some((held, doubt)) => self.smoother.hold(&held, &doubt)?,
            None => self.smoother.propagate(&ImuMean { time_ns: until_ns, ..*sample })?,
        }
        self.filter.propagate(until_ns, sample, since_ns)?;
        self.follow()
    }

    pub(super) fn camera_frame(&mut self) -> Result<(), EstimatorError> {
        self.filter.camera_frame()?;
        self.follow()
    }

    fn keyframe(&mut self) -> Result<(), EstimatorError> {
        self.filter.keyframe()?;
        self.follow()
    }

    /// Makes the present a keyframe if the filter did.
    fn follow(&mut self) -> Result<(), EstimatorError> {
        let newest_ns = self.smoother.estimate().ok_or(Refusal::NotStarted)?.time_ns;
        let now_ns = self.filter.keyframe_ns();
        if newest_ns == now_ns {
            return Ok(());
        }
        if self.smoother.keyframes().len() >= self.smoother.params().window {
            self.leave(1);
        }
        self.smoother.add_keyframe(id_of(now_ns)).map_err(|refusal| match refusal {
            Refusal::NonFinite => EstimatorError::fatal(refusal),
            _ => refusal.into(),
        })?;
        self.update()
    }

    /// Keeps the oldest keyframes, which are about to leave the window, for the recorder.
    fn leave(&mut self, most: usize) {
        if self.records {
            let oldest: Vec<u64> = self.smoother.keyframes().take(most).collect();
            let leaving: Vec<Pose> = oldest.into_iter().filter_map(|id| self.smoothed(id)).collect();
            self.left.extend(leaving);
        }
    }

    fn smoothed(&mut self, id: u64) -> Option<Pose> {
        let covariance = self.smoother.smoothed_covariance(id)?;
        Some(Pose::of(&self.smoother.smoothed(id)?, &covariance))
    }

    fn update(&mut self) -> Result<(), EstimatorError> {
        self.is_converged = self.smoother.update().map_err(EstimatorError::fatal)?.is_converged;
        Ok(())
    }

    pub(super) fn measure(&mut self, measured: &Measured<'_, F>) -> Result<Fused, EstimatorError> {
        // Without a camera, nothing else determines the times of keyframes. The dependence of a provider's factor on the present state is
        // unknown, so it cannot be carried back.
        if !self.filter.has_camera() || matches!(measured, Measured::Provided(_)) {
            self.keyframe()?;
        }
        let resets = self.filter.resets();
        let fused = self.filter.measure(measured);
        // A relative pose ends where the next one begins: in between, the window would lose one.
        let is_between = self.filter.has_camera() && !matches!(measured, Measured::Relative(_));
        let is_off = self.filter.copies().changes() != self.changes || !self.is_converged;
        if (is_off && !is_between || self.filter.resets() != resets)
            && !matches!(fused, Err(EstimatorError::Fatal(_)))
        {
            self.adopt()?;
            self.is_converged = true;
            return fused;
        }
        let fused = fused?;
        let id = id_of(self.filter.keyframe_ns());
        match measured {
            Measured::Relative(relative) => self.add(id, *relative)?,
            Measured::Anchor(anchor) => {
                let way = self.way()?;
                self.add(
                    id,
                    AbsolutePose {
                        position: anchor.position - way.position,
                        world_from_body: anchor.world_from_body * way.now_from_keyframe,
                        position_covariance: anchor.position_covariance + way.covariance,
                        rotation_covariance: anchor.rotation_covariance,
                    },
                )?;
            }
            Measured::Gnss(position, velocity, _) => {
                let way = self.way()?;
                let shown = self.filter.copies().as_shown(position);
                self.add(
                    id,
                    GnssPosition {
                        position: shown.position - way.position,
                        covariance: shown.covariance + way.covariance,
                        ..shown
                    },
                )?;
                // A receiver with a good position is trusted even if its velocity is refused.
                if let Some(velocity) = velocity.filter(|_| self.filter.has_fused_velocity()) {
                    let _ = self.add(id, GnssVelocity { velocity: velocity.velocity - way.velocity, ..velocity });
                }
            }
            Measured::Provided(factor) => self.hold(id, Held::Provided((*factor).clone()))?,
        }
        self.update()?;
        if !self.is_converged && !is_between {
            self.adopt()?;
        }
        Ok(fused)
    }

    /// Adds what the filter has fused.
    fn add(&mut self, id: u64, factor: impl Into<NavigationFactor>) -> Result<(), Refusal> {
        self.hold(id, Held::Navigation(factor.into()))
    }

    fn hold(&mut self, id: u64, factor: Held<F>) -> Result<(), Refusal> {
        self.smoother.add(&mut self.open, id, factor).map(|_| ())
    }

    /// Restarts the window in the state of the filter, which is another copy than before.
    fn adopt(&mut self) -> Result<(), EstimatorError> {
        let now_ns = self.filter.state().ok_or(Refusal::NotStarted)?.0.time_ns;
        let past = self.smoother.keyframes().take_while(|id| *id < id_of(now_ns)).count();
        self.leave(past);
        self.tune();
        self.changes = self.filter.copies().changes();
        let (estimate, covariance) = self.filter.state().ok_or(Refusal::NotStarted)?;
        self.smoother.adopt::<Navigated, NAVIGATED>(id_of(estimate.time_ns), estimate, covariance)?;
        self.filter.keyframe()?;
        Ok(())
    }

    fn way(&self) -> Result<Way, Refusal> {
        let (keyframe, now) = (self.smoother.estimate(), self.smoother.predicted());
        let (keyframe, now) = (keyframe.ok_or(Refusal::NotStarted)?, now.ok_or(Refusal::NotStarted)?);
        let mut covariance = Matrix3::zeros();
        if now.time_ns > keyframe.time_ns {
            let seconds = seconds_between(keyframe.time_ns, now.time_ns)?;
            let known = self.smoother.covariance().ok_or(Refusal::Noise)?;
            covariance = known.fixed_view::<3, 3>(VELOCITY, VELOCITY) * (seconds * seconds);
        }
        Ok(Way {
            position: now.position - keyframe.position,
            velocity: now.velocity - keyframe.velocity,
            now_from_keyframe: now.world_from_body.inverse() * keyframe.world_from_body,
            covariance,
        })
    }

    pub(super) fn motion(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        self.smoother.predicted().map(|estimate| (estimate.position, estimate.velocity))
    }

    pub(super) fn attitude(&self) -> Option<UnitQuaternion<f64>> {
        self.smoother.predicted().map(|estimate| estimate.world_from_body)
    }

    pub(super) fn streams(&self) -> &Streams {
        self.filter.streams()
    }

    pub(super) fn gaps(&self) -> u32 {
        self.smoother.gaps()
    }

    pub(super) fn predictor(&self) -> Option<Predictor> {
        let (estimate, covariance) = (self.smoother.estimate()?, self.smoother.covariance()?);
        let (sensors, noise) = (&self.smoother.params().sensors, self.filter.copies().noise());
        let mut filter = EskfFilter::new(*sensors).ok()?;
        filter.multiply_noise(noise);
        filter.adopt::<Smoothed, SMOOTHED>(&estimate, &covariance).ok()?;
        Some(Predictor::of(&filter))
    }

    pub(super) fn newest(&self) -> Option<Pose> {
        Some(Pose::of(&self.smoother.estimate()?, &self.smoother.covariance()?))
    }

    pub(super) fn history(&mut self, most: usize) -> (Vec<Pose>, bool) {
        let ids: Vec<u64> = self.smoother.keyframes().rev().skip(1).take(most).collect();
        (ids.into_iter().filter_map(|id| self.smoothed(id)).collect(), true)
    }

    pub(super) fn take_left(&mut self) -> Option<Pose> {
        self.left.pop_front()
    }

    pub(super) fn keyframe_ns(&self) -> i64 {
        self.filter.keyframe_ns()
    }

    pub(super) fn keyframes(&self) -> usize {
        self.smoother.keyframes().len()
    }

    /// The window restarts with the newest keyframe.
    pub(super) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) -> Result<(), EstimatorError> {
        self.keyframe()?;
        let mut covariance = self.smoother.covariance().ok_or(Refusal::Noise)?;
        let estimate = Estimate { time_ns, ..self.smoother.estimate().ok_or(Refusal::NotStarted)? };
        add_time(&mut covariance, &estimate.velocity, deviation_s);
        self.smoother.adopt::<Smoothed, SMOOTHED>(id_of(time_ns), &estimate, &covariance)?;
        self.is_converged = true;
        self.filter.set_clock(time_ns, deviation_s)
    }

    /// The window restarts with the newest keyframe.
    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), EstimatorError> {
        // Otherwise samples since the newest keyframe would be lost.
        self.keyframe()?;
        let covariance = self.smoother.covariance().ok_or(Refusal::Noise)?;
        let mut estimate = self.smoother.estimate().ok_or(Refusal::NotStarted)?;
        estimate.position = new_from_old.transform_point(&estimate.position.into()).coords;
        estimate.velocity = new_from_old.rotation * estimate.velocity;
        estimate.world_from_body = new_from_old.rotation * estimate.world_from_body;
        let mut turn = SMatrix::<f64, SMOOTHED, SMOOTHED>::identity();
        let rotation = new_from_old.rotation.to_rotation_matrix().into_inner();
        for first in [POSITION, VELOCITY, ROTATION] {
            turn.fixed_view_mut::<3, 3>(first, first).copy_from(&rotation);
        }
        let covariance = turn * covariance * turn.transpose();
        self.smoother.adopt::<Smoothed, SMOOTHED>(
            id_of(estimate.time_ns),
            &estimate,
            &(0.5 * (covariance + covariance.transpose())),
        )?;
        self.filter.move_world(new_from_old)
    }
}

const _: () = assert!(SMOOTHED == Smoothed::DIMENSION);
const _: () = assert!(matches!(Smoothed::OPTIONAL, [Optional::RelativeScale]));
