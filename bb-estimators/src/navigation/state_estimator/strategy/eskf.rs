//! The error-state Kalman filter.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector3};

use super::{Cadence, Failure, Measured, Place, Pose, Predictor, Streams, add_time, id_of, trusting};
use crate::attitude::ParamsError;
use crate::navigation::eskf::{Eskf, ImuMean, Start};
use crate::navigation::fused::Fused;
use crate::navigation::measurement::{Linearised, Measurement};
use crate::navigation::navigator::{NAVIGATED, Navigated};
use crate::navigation::refusal::Refusal;
use crate::navigation::smoother::{Factor, Rows};
use crate::navigation::state::{Estimate, States};
use crate::navigation::state_estimator::factor::ProvidedFactor;
use crate::navigation::state_estimator::params::StateEstimatorConfig;
use crate::navigation::stream::Stream;

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
        })
    }

    pub(super) fn start(&mut self, start: &Start) -> Result<(), Refusal> {
        self.filter.start(start)?;
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
            self.filter.set_keyframe(id_of(self.cadence.camera_ns));
        }
        self.filter.propagate_part(sample, is_gap)?;
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
        let streams = &mut self.streams;
        let fused = match measured {
            Measured::Relative(pose) => self.filter.update(&mut streams.relative, pose).map_err(absurd)?,
            Measured::Anchor(pose, trust) => {
                self.filter.update(trusting(&mut streams.anchors, *trust), pose).map_err(absurd)?
            }
            Measured::Gnss(position, velocity, trust) => {
                let stream = trusting(&mut streams.positions, *trust);
                let fused = self.filter.update(stream, position).map_err(absurd)?;
                if let Some(velocity) = velocity {
                    // A receiver with a good position is trusted even if its velocity is refused.
                    let _ = self.filter.update(&mut streams.velocities, velocity);
                }
                fused
            }
            Measured::Provided(factor) => update(&mut self.filter, &mut streams.provided, *factor)?,
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
        Ok(())
    }

    pub(super) fn relocate(&mut self, place: &Place) -> Result<(), Refusal> {
        let world_from_body = self.filter.estimate().ok_or(Refusal::NotStarted)?.world_from_body;
        let (antenna, covariance) = place.position;
        let position = (antenna - world_from_body * place.lever_arm, covariance);
        self.filter.relocate(position, place.velocity, None)?;
        self.streams.positions.forgive();
        self.begin(self.filter.estimate().ok_or(Refusal::NotStarted)?.time_ns);
        Ok(())
    }

    pub(super) fn move_world(&mut self, new_from_old: &Isometry3<f64>) -> Result<(), Refusal> {
        self.filter.move_world(new_from_old)?;
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
