//! The fixed-lag smoother.
//!
//! Keyframes are the frames of the camera. Without a camera, they are made at intervals, and at measurements. A measurement between
//! two keyframes is carried back to the earlier one by the motion since then.

use alloc::vec::Vec;

use nalgebra::{Isometry3, Matrix3, SMatrix, UnitQuaternion, Vector3};

use super::{Cadence, Failure, Measured, Pose, Predictor, Streams, Trust, add_time, id_of};
use crate::attitude::ParamsError;
use crate::navigation::chi_square::limit;
use crate::navigation::copies::{FAR, Newcomer, SLACK, Settled};
use crate::navigation::eskf::{Eskf, ImuMean, Start, seconds_between};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{AbsolutePose, GnssPosition, GnssVelocity, Measurement};
use crate::navigation::refusal::Refusal;
use crate::navigation::smoother::{Factor, FixedLagSmoother, NavigationFactor, Rows, SmootherParams};
use crate::navigation::state::{Estimate, NAVIGATED, Navigated, Optional, POSITION, ROTATION, States, VELOCITY};
use crate::navigation::state_estimator::factor::{ProvidedFactor, SMOOTHED, Smoothed};
use crate::navigation::state_estimator::params::StateEstimatorConfig;
use crate::navigation::stream::Stream;

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
    /// The window's filter as if it had been where positions are that do not fit.
    newcomer: Option<Newcomer<Eskf<Navigated, NAVIGATED>>>,
    /// `true` if the present becomes the reference of the newcomer's next relative pose.
    is_next: bool,
    /// The time since which the window has been in its place.
    since_ns: i64,
    resets: u32,
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
            newcomer: None,
            is_next: false,
            since_ns: i64::MIN,
            resets: 0,
        })
    }

    pub(super) fn is_converged(&self) -> bool {
        self.is_converged
    }

    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.smoother.start(id_of(start.time_ns), start)?;
        self.begun(start.time_ns, start.time_ns);
        // Earlier refusals relate to another estimate.
        self.streams.anchors.forgive();
        Ok(())
    }

    /// The window has begun again, in a place that has been right since a time.
    fn begun(&mut self, time_ns: i64, since_ns: i64) {
        self.is_converged = true;
        self.cadence.begin(time_ns);
        (self.newcomer, self.since_ns) = (None, since_ns);
        self.resets = self.resets.wrapping_add(1);
    }

    /// Returns how often it started, or went on in another place.
    pub(super) fn resets(&self) -> u32 {
        self.resets
    }

    pub(super) fn propagate(&mut self, until_ns: i64, sample: &ImuMean, since_ns: i64) -> Result<(), Failure> {
        let is_gap = seconds_between(since_ns, sample.time_ns)? > self.smoother.params().sensors.longest_sample;
        let part = ImuMean { time_ns: until_ns, ..*sample };
        self.smoother.propagate_part(&part, is_gap)?;
        if core::mem::take(&mut self.is_next)
            && let Some(newcomer) = &mut self.newcomer
        {
            newcomer.filter.set_keyframe(id_of(self.cadence.camera_ns));
        }
        self.newcomer.take_if(|newcomer| newcomer.filter.propagate_part(&part, is_gap).is_err());
        if self.cadence.is_due(until_ns) { self.keyframe() } else { Ok(()) }
    }

    pub(super) fn camera_frame(&mut self) -> Result<(), Failure> {
        self.keyframe()?;
        self.cadence.camera_frame();
        self.is_next = true;
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
                if let Some(newcomer) = &mut self.newcomer {
                    newcomer.aid(relative, relative, limit(6, self.streams.relative.params().gate));
                }
                let factor = Held::Navigation((*relative).into());
                self.smoother.add(&mut self.streams.relative, id, factor)?
            }
            Measured::Anchor(anchor) => {
                let way = self.way()?;
                let factor = AbsolutePose {
                    position: anchor.position - way.position,
                    world_from_body: anchor.world_from_body * way.now_from_keyframe,
                    position_covariance: anchor.position_covariance + way.covariance,
                    rotation_covariance: anchor.rotation_covariance,
                };
                let admitted = self.admitted(anchor);
                let admitted = self.settle(anchor, admitted)?;
                add(&mut self.smoother, &mut self.streams.anchors, id, factor, admitted)?
            }
            Measured::Gnss(position, velocity, trust) => {
                let way = self.way()?;
                let moved = GnssPosition {
                    position: position.position - way.position,
                    covariance: position.covariance + way.covariance,
                    ..*position
                };
                let mut admitted = self.admitted(position);
                if matches!(trust, Trust::Believed) {
                    admitted = self.settle(position, admitted)?;
                }
                let fused = add(&mut self.smoother, &mut self.streams.positions, id, moved, admitted)?;
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

    /// The log likelihood of a position, if the gate of the filter admits it.
    fn admitted<M: Measurement<D>, const D: usize>(&self, measurement: &M) -> Result<f64, Refusal> {
        let judged = self.copied().ok_or(Refusal::Noise)?.judge(measurement, SLACK)?;
        if judged.nis <= FAR {
            return Ok(judged.log_likelihood);
        }
        Err(Refusal::Gate { nis: judged.nis, limit: FAR })
    }

    /// Decides between the window and its newcomer by a position. Returns whether the window still admits it.
    fn settle<M: Measurement<D>, const D: usize>(
        &mut self,
        measurement: &M,
        admitted: Result<f64, Refusal>,
    ) -> Result<Result<f64, Refusal>, Failure> {
        let refusal = match admitted {
            Ok(_) => Refusal::Gate { nis: FAR, limit: FAR },
            Err(refusal @ Refusal::Gate { .. }) => refusal,
            Err(_) => return Ok(admitted),
        };
        match Newcomer::settle(&mut self.newcomer, measurement, admitted.ok()) {
            Settled::Kept => return Ok(admitted),
            Settled::Left => {}
            Settled::Due(newcomer) => self.take_over(&newcomer)?,
            Settled::Unfit => {
                let copied = self.copied();
                self.newcomer = copied.and_then(|filter| Newcomer::new(filter, self.since_ns, measurement));
            }
        }
        Ok(Err(refusal))
    }

    /// A filter in the present state, as uncertain as the newest keyframe.
    fn copied(&self) -> Option<Eskf<Navigated, NAVIGATED>> {
        let mut filter = Eskf::new(self.smoother.params().sensors).ok()?;
        filter.adopt::<Smoothed, SMOOTHED>(&self.smoother.predicted()?, &self.smoother.covariance()?).ok()?;
        Some(filter)
    }

    /// Restarts the window with the state of a newcomer.
    fn take_over(&mut self, newcomer: &Newcomer<Eskf<Navigated, NAVIGATED>>) -> Result<(), Refusal> {
        let filter = &newcomer.filter;
        let estimate = filter.estimate().ok_or(Refusal::NotStarted)?;
        let time_ns = estimate.time_ns;
        self.smoother.adopt::<Navigated, NAVIGATED>(id_of(time_ns), estimate, filter.covariance())?;
        self.begun(time_ns, newcomer.born_ns());
        self.streams.anchors.forgive();
        self.streams.positions.forgive();
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
        let now = self.smoother.estimate().ok_or(Refusal::NotStarted)?;
        let (before_ns, estimate) = (now.time_ns, Estimate { time_ns, ..now });
        add_time(&mut covariance, &estimate.velocity, deviation_s);
        let since_ns = self.since_ns.saturating_add(time_ns.saturating_sub(before_ns));
        self.smoother.adopt::<Smoothed, SMOOTHED>(id_of(time_ns), &estimate, &covariance)?;
        self.begun(time_ns, since_ns);
        Ok(())
    }

    /// The window restarts with the newest keyframe.
    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        self.newcomer.take_if(|newcomer| newcomer.filter.move_world(new_from_old).is_err());
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

/// Adds a position that is admitted, and counts one that is not.
fn add<F: ProvidedFactor>(
    smoother: &mut FixedLagSmoother<Smoothed, SMOOTHED, Held<F>>,
    stream: &mut Stream,
    id: u64,
    factor: impl Into<NavigationFactor>,
    admitted: Result<f64, Refusal>,
) -> Result<Fused, Refusal> {
    match admitted {
        Ok(_) => smoother.add(stream, id, Held::Navigation(factor.into())),
        Err(refusal) => {
            let result = Err(refusal);
            stream.count(&result);
            result
        }
    }
}

const _: () = assert!(SMOOTHED == Smoothed::DIMENSION);
const _: () = assert!(matches!(Smoothed::OPTIONAL, [Optional::RelativeScale]));
