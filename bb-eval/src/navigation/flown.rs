//! Runs the state estimator on a data set as in a flight, with stamps and places on the Earth.

use super::allocations::counted;
use super::data::{DataSet, Keyframe, nanoseconds};
use super::measured::Measured;
use super::step::{Known, Step};
use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_estimators::navigation::state_estimator::{
    Added, AttitudeReading, EstimatorError, EstimatorOutput, FlightControllerState, GnssReading, GpsHealth,
    GpsHealthReading, PoseAnchor, Reason, StateEstimator, StateEstimatorConfig, StateEstimatorParams, StrategyKind,
    VioOutput,
};
use bb_estimators::navigation::{AbsolutePose, EskfParams, Geodetic, ImuMean, LocalFrame, RelativePose, Start};
use std::time::Instant;

/// A state estimator, and the place of the data set's world on the Earth.
pub(crate) struct Flown {
    estimator: StateEstimator,
    frame: LocalFrame,
    /// For each keyframe so far, the end of the last sample before it, ns.
    stamps_ns: Vec<i64>,
    window: usize,
    /// Whether it uses fixes in addition to relative poses.
    takes_fixes: bool,
}

impl Flown {
    pub(crate) fn new(
        data: &DataSet,
        strategy: StrategyKind,
        sensors: EskfParams,
        window: usize,
        takes_fixes: bool,
    ) -> Result<Self, String> {
        let shortest = data.samples.iter().map(|sample| sample.dt).fold(f64::INFINITY, f64::min);
        let params = StateEstimatorParams {
            window: u32::try_from(window).unwrap_or(u32::MAX),
            imu_rate: (1.0 / shortest).clamp(100.0, 10_000.0),
            // The start is known as well as the data set says.
            warm_inflation: 1.0,
            accelerometer_bias: data.start.accelerometer_bias_deviation,
            gyroscope_bias: data.start.gyroscope_bias_deviation,
            record_keyframes: false,
            ..StateEstimatorParams::default()
        };
        let config = StateEstimatorConfig { strategy, params, sensors, flight: 0 };
        let estimator = StateEstimator::new(config, ()).map_err(|error| error.to_string())?;
        // Any place will do: the data set's world is a tangent frame, and so is the estimator's.
        let frame = LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0));
        Ok(Self { estimator, frame, stamps_ns: Vec::new(), window, takes_fixes })
    }

    pub(crate) fn start(&mut self, start: &Start) -> Result<(), String> {
        let (position, local_from_world) = self.local(&start.position);
        let turned = |covariance: &Matrix3<f64>| turned(&local_from_world, covariance);
        let rotation = turned(&start.rotation_covariance);
        self.stamps_ns = vec![start.time_ns];
        let state = FlightControllerState {
            attitude: AttitudeReading {
                time_ns: start.time_ns,
                world_from_body: local_from_world * start.world_from_body,
                tilt_deviation: rotation[(0, 0)].sqrt(),
                heading_deviation: rotation[(2, 2)].sqrt(),
            },
            position,
            position_covariance: turned(&start.position_covariance),
            velocity: local_from_world * start.velocity,
            velocity_covariance: turned(&start.velocity_covariance),
        };
        self.estimator.warm_start(state).map(drop).map_err(|error| error.to_string())
    }

    /// A position of the data set on the Earth, and the rotation from its world to the tangent frame there.
    fn local(&self, position: &Vector3<f64>) -> (Geodetic, UnitQuaternion<f64>) {
        let position = self.frame.geodetic(position);
        (position, self.frame.other_from_self(&LocalFrame::new(position)).rotation)
    }

    /// From the previous keyframe to keyframe `k`.
    pub(crate) fn play(
        &mut self,
        data: &DataSet,
        k: usize,
        from: &Keyframe,
        to: &Keyframe,
        step: &mut Step,
    ) -> Result<(), String> {
        let began = Instant::now();
        let mut time_s = from.time_s;
        let mut now_ns = self.stamps_ns.last().copied().unwrap_or_default();
        for sample in data.samples.get(from.sample..to.sample).unwrap_or_default() {
            time_s += sample.dt;
            now_ns = nanoseconds(time_s);
            let (angular_velocity, specific_force) = (sample.angular_velocity, sample.specific_force);
            let sample = ImuMean { time_ns: now_ns, angular_velocity, specific_force };
            if let Err(error) = taken(self.estimator.add_imu(&sample)) {
                step.refused += 1;
                step.samples.0 += 1;
                step.samples.1.get_or_insert(error);
            }
        }
        step.propagation_s = began.elapsed().as_secs_f64();
        self.stamps_ns.push(now_ns);
        let keyframe_began = Instant::now();
        let mut added = [const { None }; 3];
        let allocations = counted(|| added = self.measure(&Measured::at(data, k as u64), now_ns));
        step.keyframe_s = keyframe_began.elapsed().as_secs_f64();
        step.allocations = allocations;
        let [vio, anchor, fix] = added.map(|added| added.map(taken));
        step.take([vio, anchor, fix, None]);
        Ok(())
    }

    /// All processing at a keyframe.
    fn measure(&mut self, measured: &Measured, now_ns: i64) -> [Option<Result<Added, EstimatorError>>; 3] {
        let vio = measured.relative.and_then(|relative| self.vio(&relative, now_ns));
        let anchor = measured.anchor.map(|anchor| self.anchor(&anchor, now_ns));
        let fix = measured.fix.filter(|_| self.takes_fixes || measured.filters_take_fixes).map(|fix| {
            let (position, local_from_world) = self.local(&fix.position);
            GnssReading {
                time_ns: now_ns,
                position,
                covariance: turned(&local_from_world, &fix.covariance),
                velocity: None,
                lever_arm: fix.lever_arm,
            }
        });
        let estimator = &mut self.estimator;
        if fix.is_some() {
            // Data sets contain only accepted measurements. Delayed ones would be recomputed.
            let _ = estimator.add_gps_health(GpsHealthReading { time_ns: now_ns, health: GpsHealth::Stable });
        }
        let added = [
            vio.map(|vio| estimator.add_vio(vio)),
            anchor.map(|anchor| estimator.add_pose_anchor(anchor)),
            fix.map(|fix| estimator.add_gnss(fix)),
        ];
        let _ = estimator.predicted(now_ns);
        added
    }

    fn vio(&self, relative: &RelativePose, now_ns: i64) -> Option<VioOutput> {
        let from = usize::try_from(relative.keyframe).ok()?;
        Some(VioOutput {
            from_ns: *self.stamps_ns.get(from)?,
            to_ns: now_ns,
            translation: relative.translation,
            from_to: relative.keyframe_from_body,
            covariance: both(&relative.translation_covariance, &relative.rotation_covariance),
            bias: None,
        })
    }

    fn anchor(&self, anchor: &AbsolutePose, now_ns: i64) -> PoseAnchor {
        let (position, local_from_world) = self.local(&anchor.position);
        let turned = |covariance: &Matrix3<f64>| turned(&local_from_world, covariance);
        PoseAnchor {
            time_ns: now_ns,
            provider: 0,
            position,
            world_from_body: local_from_world * anchor.world_from_body,
            covariance: both(&turned(&anchor.position_covariance), &turned(&anchor.rotation_covariance)),
            is_covariance_degraded: false,
        }
    }

    fn known(&self, output: &EstimatorOutput) -> Known {
        let position = self.frame.position(&output.position);
        let world_from_local = self.frame.other_from_self(&LocalFrame::new(output.position)).rotation.inverse();
        let mut turn = Matrix6::zeros();
        let rotation = world_from_local.to_rotation_matrix().into_inner();
        [0, 3].iter().for_each(|first| turn.fixed_view_mut::<3, 3>(*first, *first).copy_from(&rotation));
        Known {
            position,
            velocity: world_from_local * output.velocity,
            world_from_body: world_from_local * output.world_from_body,
            covariance: turn * output.covariance * turn.transpose(),
        }
    }

    /// The estimate at the newest keyframe.
    pub(crate) fn newest(&mut self) -> Option<Known> {
        self.estimator.predicted(*self.stamps_ns.last()?).map(|output| self.known(&output))
    }

    /// The oldest keyframe of a full window, by its number, if smoothed.
    pub(crate) fn oldest(&mut self) -> Option<(usize, Known)> {
        let history = self.estimator.smoothed_history(self.window);
        let oldest = history.last().filter(|oldest| oldest.smoothed && history.len() + 1 == self.window)?;
        let k = self.stamps_ns.binary_search(&oldest.time_ns).ok()?;
        Some((k, self.known(oldest)))
    }
}

/// Whether an input is in the estimate, or why not. An input accepted despite a mismatch, one whose iterations have not converged,
/// and a bridged gap count as included.
fn taken<T>(added: Result<T, EstimatorError>) -> Result<(), String> {
    match added {
        Ok(_) | Err(EstimatorError::Degraded(Reason::Raised { .. } | Reason::Bridged | Reason::NotConverged)) => {
            Ok(())
        }
        Err(error) => Err(error.reason().to_string()),
    }
}

fn both(position: &Matrix3<f64>, rotation: &Matrix3<f64>) -> Matrix6<f64> {
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(position);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation);
    both
}

fn turned(turn: &UnitQuaternion<f64>, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let matrix = turn.to_rotation_matrix().into_inner();
    let turned = matrix * covariance * matrix.transpose();
    0.5 * (turned + turned.transpose())
}
