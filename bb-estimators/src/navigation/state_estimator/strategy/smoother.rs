//! The fixed-lag smoother.
//!
//! Keyframes are the frames of the camera. Without a camera, they are made at intervals, and at measurements. A measurement between
//! two keyframes is carried back to the earlier one by the motion since then.

use alloc::vec::Vec;

use nalgebra::{Isometry3, Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::{Cadence, Failure, Measured, Place, Pose, Predictor, Streams, add_time, id_of, trusting};
use crate::attitude::ParamsError;
use crate::navigation::eskf::{ImuMean, Start, seconds_between};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity};
use crate::navigation::refusal::Refusal;
use crate::navigation::smoother::{Factor, FixedLagSmoother, NavigationFactor, Rows, SmootherParams};
use crate::navigation::state::{Estimate, Optional, POSITION, ROTATION, States, VELOCITY};
use crate::navigation::state_estimator::factor::{ProvidedFactor, SMOOTHED, Smoothed};
use crate::navigation::state_estimator::params::StateEstimatorConfig;

#[expect(clippy::large_enum_variant, reason = "factors of providers are as large as theirs are")]
/// Configuration of a window.
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

/// See the module.
#[derive(Clone, Debug)]
pub(in crate::navigation::state_estimator) struct SmootherStrategy<F: ProvidedFactor> {
    smoother: FixedLagSmoother<Smoothed, SMOOTHED, Held<F>>,
    streams: Streams,
    cadence: Cadence,
    records: bool,
    left: Option<Pose>,
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
            streams: Streams::new(),
            cadence: Cadence::new(config),
            records: config.params.record_keyframes,
            left: None,
            is_converged: true,
        })
    }

    pub(super) fn is_converged(&self) -> bool {
        self.is_converged
    }

    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.smoother.start(id_of(start.time_ns), start)?;
        self.is_converged = true;
        self.cadence.begin(start.time_ns);
        // Earlier refusals relate to another estimate.
        self.streams.anchors.forgive();
        Ok(())
    }

    pub(super) fn propagate(&mut self, sample: &ImuMean, is_gap: bool) -> Result<(), Failure> {
        self.smoother.propagate_part(sample, is_gap)?;
        if self.cadence.is_due(sample.time_ns) { self.keyframe() } else { Ok(()) }
    }

    pub(super) fn camera_frame(&mut self) -> Result<(), Failure> {
        self.keyframe()?;
        self.cadence.camera_frame();
        Ok(())
    }

    fn keyframe(&mut self) -> Result<(), Failure> {
        let now_ns = self.smoother.predicted().ok_or(Refusal::NotStarted)?.time_ns;
        if now_ns == self.cadence.keyframe_ns {
            return Ok(());
        }
        self.left = if self.records { self.leaving() } else { None };
        self.smoother.add_keyframe(id_of(now_ns)).map_err(|refusal| match refusal {
            Refusal::NonFinite => Failure::Fatal(refusal),
            _ => Failure::Refused(refusal),
        })?;
        self.cadence.keyframe_ns = now_ns;
        self.update()
    }

    /// The oldest keyframe, if the next one will replace it.
    fn leaving(&mut self) -> Option<Pose> {
        if self.smoother.keyframes().len() < self.smoother.params().window {
            return None;
        }
        let oldest = self.smoother.keyframes().next()?;
        self.smoothed(oldest)
    }

    fn smoothed(&mut self, id: u64) -> Option<Pose> {
        let covariance = self.smoother.smoothed_covariance(id)?;
        Some(Pose::of(&self.smoother.smoothed(id)?, &covariance))
    }

    fn update(&mut self) -> Result<(), Failure> {
        self.is_converged = self.smoother.update().map_err(Failure::Fatal)?.is_converged;
        Ok(())
    }

    pub(super) fn measure(&mut self, measured: &Measured<'_, F>) -> Result<Fused, Failure> {
        let now_ns = self.smoother.predicted().ok_or(Refusal::NotStarted)?.time_ns;
        // Without a camera, nothing else determines the times of keyframes.
        if !self.cadence.has_camera(now_ns) {
            self.keyframe()?;
        }
        let id = id_of(self.cadence.keyframe_ns);
        let fused = match measured {
            Measured::Relative(relative) => {
                let factor = Held::Navigation((*relative).into());
                self.smoother.add(&mut self.streams.relative, id, factor)?
            }
            Measured::Anchor(anchor, trust) => {
                let way = self.way()?;
                let factor = AbsolutePose {
                    position: anchor.position - way.position,
                    world_from_body: anchor.world_from_body * way.now_from_keyframe,
                    position_covariance: anchor.position_covariance + way.covariance,
                    rotation_covariance: anchor.rotation_covariance,
                };
                let stream = trusting(&mut self.streams.anchors, *trust);
                self.smoother.add(stream, id, Held::Navigation(factor.into()))?
            }
            Measured::Gnss(position, velocity, trust) => {
                let way = self.way()?;
                let moved = GnssPosition {
                    position: position.position - way.position,
                    covariance: position.covariance + way.covariance,
                    ..*position
                };
                let stream = trusting(&mut self.streams.positions, *trust);
                let fused = self.smoother.add(stream, id, Held::Navigation(moved.into()))?;
                if let Some(velocity) = velocity {
                    let moved = GnssVelocity { velocity: velocity.velocity - way.velocity, ..*velocity };
                    // A receiver with a good position is trusted even if its velocity is refused.
                    let _ = self.smoother.add(&mut self.streams.velocities, id, Held::Navigation(moved.into()));
                }
                fused
            }
            Measured::Provided(factor) => {
                // The factor's dependence on the present state is unknown, so it cannot be carried back.
                if now_ns != self.cadence.keyframe_ns {
                    self.keyframe()?;
                }
                let id = id_of(now_ns);
                self.smoother.add(&mut self.streams.provided, id, Held::Provided((*factor).clone()))?
            }
        };
        self.update()?;
        Ok(fused)
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
        &self.streams
    }

    pub(super) fn gaps(&self) -> u32 {
        self.smoother.gaps()
    }

    pub(super) fn predictor(&self) -> Option<Predictor> {
        let (estimate, covariance) = (self.smoother.estimate()?, self.smoother.covariance()?);
        Predictor::from_keyframe::<Smoothed, SMOOTHED>(&self.smoother.params().sensors, &estimate, &covariance)
    }

    pub(super) fn newest(&self) -> Option<Pose> {
        Some(Pose::of(&self.smoother.estimate()?, &self.smoother.covariance()?))
    }

    pub(super) fn history(&mut self, most: usize) -> (Vec<Pose>, bool) {
        let ids: Vec<u64> = self.smoother.keyframes().rev().skip(1).take(most).collect();
        (ids.into_iter().filter_map(|id| self.smoothed(id)).collect(), true)
    }

    pub(super) fn take_left(&mut self) -> Option<Pose> {
        self.left.take()
    }

    pub(super) fn keyframe_ns(&self) -> i64 {
        self.cadence.keyframe_ns
    }

    pub(super) fn keyframes(&self) -> usize {
        self.smoother.keyframes().len()
    }

    /// The window restarts with the newest keyframe.
    pub(super) fn set_clock(&mut self, time_ns: i64, deviation_s: f64) -> Result<(), Refusal> {
        if let Err(Failure::Refused(refusal) | Failure::Fatal(refusal)) = self.keyframe() {
            return Err(refusal);
        }
        let mut covariance = self.smoother.covariance().ok_or(Refusal::Noise)?;
        let estimate = Estimate { time_ns, ..self.smoother.estimate().ok_or(Refusal::NotStarted)? };
        add_time(&mut covariance, &estimate.velocity, deviation_s);
        self.smoother.adopt::<Smoothed, SMOOTHED>(id_of(time_ns), &estimate, &covariance)?;
        self.is_converged = true;
        self.cadence.begin(time_ns);
        Ok(())
    }

    /// The window restarts with the present state.
    pub(super) fn relocate(&mut self, place: &Place) -> Result<(), Refusal> {
        if let Err(Failure::Refused(refusal) | Failure::Fatal(refusal)) = self.keyframe() {
            return Err(refusal);
        }
        let mut covariance = self.smoother.covariance().ok_or(Refusal::Noise)?;
        let mut estimate = self.smoother.estimate().ok_or(Refusal::NotStarted)?;
        estimate.position = place.position.0 - estimate.world_from_body * place.lever_arm;
        replace(&mut covariance, POSITION, &place.position.1);
        if let Some((velocity, of_velocity)) = place.velocity {
            estimate.velocity = velocity;
            replace(&mut covariance, VELOCITY, &of_velocity);
        }
        self.smoother.adopt::<Smoothed, SMOOTHED>(id_of(estimate.time_ns), &estimate, &covariance)?;
        self.is_converged = true;
        self.streams.positions.forgive();
        Ok(())
    }

    /// The window restarts with the newest keyframe.
    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        // Otherwise samples since the newest keyframe would be lost.
        if let Err(Failure::Refused(refusal) | Failure::Fatal(refusal)) = self.keyframe() {
            return Err(refusal);
        }
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

/// Replaces the covariance of three errors and clears their correlations with all others.
fn replace(covariance: &mut SMatrix<f64, SMOOTHED, SMOOTHED>, first: usize, by: &Matrix3<f64>) {
    covariance.rows_mut(first, 3).fill(0.0);
    covariance.columns_mut(first, 3).fill(0.0);
    covariance.fixed_view_mut::<3, 3>(first, first).copy_from(by);
}

const _: () = assert!(SMOOTHED == Smoothed::DIMENSION);
const _: () = assert!(matches!(Smoothed::OPTIONAL, [Optional::RelativeScale]));
