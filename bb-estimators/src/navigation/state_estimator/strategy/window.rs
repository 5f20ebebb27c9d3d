//! The window of the fixed-lag smoother, which follows the filter.
//!
//! Both get the same inputs. The filter decides what is fused, finds the noise of the IMU and of fixes and whether the scale of relative
//! poses drifts, and moves to where positions agree. Whenever another of its copies becomes the best, the window restarts in that copy's
//! state, with its noise: what it has concluded with another noise is more or less certain than its covariance says. It restarts there as
//! well when an update does not converge: what leaves it would be linearised in the wrong place for good.
//!
//! Keyframes are the frames of the camera. Without a camera, they are made at intervals, and at measurements. A measurement between
//! two keyframes is carried back to the earlier one by the motion since then.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::{Isometry3, Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::{Measured, Pose, id_of};
use crate::attitude::ParamsError;
use crate::navigation::copies::Copies;
use crate::navigation::eskf::{Doubt, EskfFilter, ImuMean, Start, seconds_between};
use crate::navigation::factor::{Factor, NavigationFactor, Rows};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity, RelativePose};
use crate::navigation::refusal::Refusal;
use crate::navigation::smoother::{FixedLagSmoother, LandmarkParams, Observation, Sighted, SmootherParams};
use crate::navigation::state::{Estimate, NAVIGATED, Navigated, Optional, POSITION, ROTATION, States, VELOCITY};
use crate::navigation::state_estimator::error::EstimatorError;
use crate::navigation::state_estimator::factor::{ProvidedFactor, SMOOTHED, Smoothed};
use crate::navigation::state_estimator::given::PoseRows;
use crate::navigation::state_estimator::input::Feature;
use crate::navigation::state_estimator::params::StateEstimatorConfig;
use crate::navigation::stream::{Stream, StreamParams};

/// A factor in the window: of this crate, or of a provider.
#[derive(Clone, Copy, Debug)]
pub(super) enum Held<F> {
    Navigation(NavigationFactor),
    Provided(F),
    Linear(PoseRows),
}

impl<S: States, const N: usize, F: Factor<S, N>> Factor<S, N> for Held<F> {
    fn previous(&self) -> Option<u64> {
        match self {
            Self::Navigation(factor) => Factor::<S, N>::previous(factor),
            Self::Provided(factor) => factor.previous(),
            Self::Linear(_) => None,
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
            Self::Linear(factor) => Factor::<S, N>::linearise(factor, previous, at, rows),
        }
    }
}

/// The window. Its newest keyframe is that of the filter.
#[derive(Clone, Debug)]
pub(super) struct Window<F: ProvidedFactor> {
    smoother: FixedLagSmoother<Smoothed, SMOOTHED, Held<F>>,
    /// The changes of the best copy that the window has followed.
    changes: u32,
    /// A stream without a gate, for measurements that the filter has fused.
    open: Stream,
    /// The gate of relative poses to keyframes that the filter does not hold.
    related: Stream,
    /// The gate of landmarks.
    sights: Stream,
    has_camera: bool,
    records: bool,
    left: VecDeque<Pose>,
    /// `false` if the last update did not converge.
    is_converged: bool,
}

/// The filter that the window follows.
type Filter = Copies<EskfFilter<Navigated, NAVIGATED>>;

/// Motion from the newest keyframe to the present.
struct Way {
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Rotates body coordinates at the keyframe to those at present.
    now_from_keyframe: UnitQuaternion<f64>,
    /// Covariance of that position.
    covariance: Matrix3<f64>,
}

impl<F: ProvidedFactor> Window<F> {
    pub(super) fn new(config: &StateEstimatorConfig) -> Result<Self, ParamsError> {
        let window = config.params.window as usize;
        let params = SmootherParams { sensors: config.sensors, window, ..SmootherParams::default() };
        let mut smoother = FixedLagSmoother::new(params)?;
        if let Some(camera) = config.camera {
            let landmarks = config.params.landmarks as usize;
            smoother.set_camera(camera, LandmarkParams { landmarks, ..LandmarkParams::default() })?;
        }
        Ok(Self {
            smoother,
            changes: 0,
            open: Stream::new(StreamParams { gate: 0.0, ..StreamParams::default() }),
            related: Stream::default(),
            sights: Stream::default(),
            has_camera: config.camera.is_some(),
            records: config.params.record_keyframes,
            left: VecDeque::new(),
            is_converged: true,
        })
    }

    pub(super) fn is_converged(&self) -> bool {
        self.is_converged
    }

    /// Returns whether it converges, with what the filter has found.
    pub(super) fn fits(&self, filter: &Filter) -> bool {
        filter.changes() == self.changes && self.is_converged
    }

    pub(super) fn start(&mut self, start: &Start, filter: &Filter) -> Result<(), Refusal> {
        self.tune(filter);
        self.smoother.start(id_of(start.time_ns), start)?;
        self.is_converged = true;
        Ok(())
    }

    /// Takes over what the filter has found: the noise of the IMU, and whether the scale of relative poses drifts.
    fn tune(&mut self, filter: &Filter) {
        self.smoother.set_noise(filter.noise());
        self.smoother.set_relative_scale(filter.best().params().relative_scale);
        self.changes = filter.changes();
    }

    /// Advances over a part of a sample, or of a gap over which the filter holds a reading.
    pub(super) fn propagate(&mut self, part: &ImuMean, held: Option<(ImuMean, Doubt)>) -> Result<(), Refusal> {
        match held {
            Some((held, doubt)) => self.smoother.hold(&held, &doubt),
            None => self.smoother.propagate(part),
        }
    }

    /// Makes the present a keyframe if the filter did.
    pub(super) fn follow(&mut self, now_ns: i64) -> Result<(), EstimatorError> {
        let newest_ns = self.smoother.estimate().ok_or(Refusal::NotStarted)?.time_ns;
        if newest_ns == now_ns {
            return Ok(());
        }
        if self.keyframes() >= self.smoother.params().window {
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

    /// Adds a measurement that the filter has fused, and its velocity if that was fused too, to the newest keyframe.
    pub(super) fn add(
        &mut self,
        measured: &Measured<'_, F>,
        id: u64,
        filter: &Filter,
        has_velocity: bool,
    ) -> Result<(), EstimatorError> {
        match measured {
            Measured::Relative(pose) | Measured::Between(pose) => self.hold(id, self.related(measured, pose))?,
            Measured::Anchor(anchor) => {
                let way = self.way()?;
                self.hold(
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
                let shown = filter.as_shown(position);
                self.hold(
                    id,
                    GnssPosition {
                        position: shown.position - way.position,
                        covariance: shown.covariance + way.covariance,
                        ..shown
                    },
                )?;
                // A receiver with a good position is trusted even if its velocity is refused.
                if let Some(velocity) = velocity.filter(|_| has_velocity) {
                    let _ = self.hold(id, GnssVelocity { velocity: velocity.velocity - way.velocity, ..velocity });
                }
            }
            Measured::Provided(factor) => self.hold_factor(id, Held::Provided((*factor).clone()))?,
            Measured::Linear(rows) => self.hold_factor(id, Held::Linear(**rows))?,
            Measured::Features(_) => return Err(Refusal::NotObservable.into()),
        }
        self.update()
    }

    /// Returns whether it has this keyframe.
    pub(super) fn has(&self, keyframe: u64) -> bool {
        self.smoother.keyframes().any(|id| id == keyframe)
    }

    /// Judges a relative pose of the newest keyframe to one that the filter does not hold, and adds it.
    pub(super) fn relate(
        &mut self,
        measured: &Measured<'_, F>,
        id: u64,
        pose: &RelativePose,
    ) -> Result<Fused, EstimatorError> {
        let factor = self.related(measured, pose);
        let fused = self.smoother.add(&mut self.related, id, Held::Navigation(factor))?;
        self.update()?;
        Ok(fused)
    }

    /// Adds the landmarks of an image at a keyframe, each with a gate of its own. The result is that of those that are used.
    pub(super) fn observe(&mut self, id: u64, features: &[Feature]) -> Result<Fused, EstimatorError> {
        if !self.has_camera {
            return Err(Refusal::NotObservable.into());
        }
        let limit = self.sights.params().gate;
        let mut seen = Fused { nis: 0.0, dimension: 0, weight: 1.0, limit, log_likelihood: 0.0, whitened: 0.0 };
        let (mut first, mut is_refused) = (None, !features.is_empty());
        for Feature { landmark, pixel, deviation_px } in features {
            let observation = Observation::new(*landmark, *pixel, *deviation_px);
            match self.smoother.observe(&mut self.sights, id, &observation) {
                Ok(Sighted::Used(fused)) => {
                    seen.nis += fused.nis;
                    seen.dimension += fused.dimension;
                    seen.log_likelihood += fused.log_likelihood;
                    is_refused = false;
                }
                Ok(Sighted::Waiting) => is_refused = false,
                Err(refusal) => first = first.or(Some(refusal)),
            }
        }
        self.update()?;
        match first {
            Some(refusal) if is_refused => Err(refusal.into()),
            _ => Ok(seen),
        }
    }

    /// The motion between two keyframes, as a measurement for the filter. An image is in as many windows as they have keyframes, and
    /// all their motions rest on it: each is told with its share of the information, so that the image counts once.
    pub(super) fn motion(&mut self, from: u64, to: u64) -> Option<RelativePose> {
        let mut motion = self.smoother.relative(from, to)?;
        let windows = self.keyframes() as f64;
        motion.translation_covariance *= windows;
        motion.rotation_covariance *= windows;
        Some(motion)
    }

    /// The factor of a relative pose at the newest keyframe. The scale of the camera's is known from one keyframe to the next; between
    /// others, it is part of the noise.
    fn related(&self, measured: &Measured<'_, F>, pose: &RelativePose) -> NavigationFactor {
        let is_next = self.smoother.keyframes().rev().nth(1) == Some(pose.keyframe);
        match measured {
            Measured::Relative(_) if is_next => NavigationFactor::RelativePose(*pose),
            Measured::Relative(_) => {
                let deviation = self.smoother.params().sensors.relative_scale.deviation;
                let way = pose.keyframe_from_body.inverse_transform_vector(&pose.translation) * deviation;
                let translation_covariance = pose.translation_covariance + way * way.transpose();
                NavigationFactor::Between(RelativePose { translation_covariance, ..*pose })
            }
            _ => NavigationFactor::Between(*pose),
        }
    }

    fn hold(&mut self, id: u64, factor: impl Into<NavigationFactor>) -> Result<(), Refusal> {
        self.hold_factor(id, Held::Navigation(factor.into()))
    }

    fn hold_factor(&mut self, id: u64, factor: Held<F>) -> Result<(), Refusal> {
        self.smoother.add(&mut self.open, id, factor).map(|_| ())
    }

    /// Restarts in the state of the filter.
    pub(super) fn restart(&mut self, filter: &Filter, is_converged: bool) -> Result<(), EstimatorError> {
        let best = filter.best();
        let estimate = best.estimate().ok_or(Refusal::NotStarted)?;
        let id = id_of(estimate.time_ns);
        self.leave(self.smoother.keyframes().take_while(|before| *before < id).count());
        self.tune(filter);
        self.smoother.adopt::<Navigated, NAVIGATED>(id, estimate, best.covariance())?;
        self.is_converged = is_converged;
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

    pub(super) fn predicted(&self) -> Option<Estimate<SMOOTHED>> {
        self.smoother.predicted()
    }

    /// A filter in the state of the newest keyframe.
    pub(super) fn filter(&self, noise: f64) -> Option<EskfFilter<Navigated, NAVIGATED>> {
        let mut filter = EskfFilter::new(self.smoother.params().sensors).ok()?;
        filter.multiply_noise(noise);
        filter.adopt::<Smoothed, SMOOTHED>(&self.smoother.estimate()?, &self.smoother.covariance()?).ok()?;
        Some(filter)
    }

    pub(super) fn newest(&self) -> Option<Pose> {
        Some(Pose::of(&self.smoother.estimate()?, &self.smoother.covariance()?))
    }

    pub(super) fn history(&mut self, most: usize) -> Vec<Pose> {
        let ids: Vec<u64> = self.smoother.keyframes().rev().skip(1).take(most).collect();
        ids.into_iter().filter_map(|id| self.smoothed(id)).collect()
    }

    pub(super) fn take_left(&mut self) -> Option<Pose> {
        self.left.pop_front()
    }

    pub(super) fn keyframes(&self) -> usize {
        self.smoother.keyframes().len()
    }

    /// Restarts with the newest keyframe.
    pub(super) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) -> Result<(), Refusal> {
        let mut covariance = self.smoother.covariance().ok_or(Refusal::Noise)?;
        let estimate = Estimate { time_ns, ..self.smoother.estimate().ok_or(Refusal::NotStarted)? };
        // What the body moves in that time.
        let way = estimate.velocity * deviation_s;
        let mut of_position = covariance.fixed_view_mut::<3, 3>(POSITION, POSITION);
        of_position += way * way.transpose();
        self.smoother.adopt::<Smoothed, SMOOTHED>(id_of(time_ns), &estimate, &covariance)?;
        self.is_converged = true;
        Ok(())
    }

    /// Restarts with the newest keyframe.
    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
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
        )
    }
}

const _: () = assert!(SMOOTHED == Smoothed::DIMENSION);
const _: () = assert!(matches!(Smoothed::OPTIONAL, [Optional::RelativeScale]));
