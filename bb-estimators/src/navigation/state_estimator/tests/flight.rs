//! A flight as sums of sinusoids, and its sensor measurements.

use super::*;
use crate::navigation::math::{rotation, rotation_vector};
use crate::navigation::noise::Noise;
use nalgebra::Rotation3;

pub(super) const SECOND: i64 = 1_000_000_000;
pub(super) const STEP: i64 = SECOND / 200;
pub(super) const FRAME: i64 = SECOND / 10;
const GRAVITY: f64 = 9.80665;

/// The truth at one instant, in the tangent frame at the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) world_from_body: UnitQuaternion<f64>,
}

/// An input of the estimator.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sent {
    Imu(ImuMean),
    Vio(VioOutput),
    Anchor(PoseAnchor),
    Fix(GnssReading),
    Health(GpsHealthReading),
}

impl Sent {
    pub(super) fn time_ns(&self) -> i64 {
        match self {
            Self::Imu(sample) => sample.time_ns,
            Self::Vio(vio) => vio.to_ns,
            Self::Anchor(anchor) => anchor.time_ns,
            Self::Fix(fix) => fix.time_ns,
            Self::Health(health) => health.time_ns,
        }
    }

    /// Returns the flight on a clock that is behind by `by_ns`.
    pub(super) fn behind(mut self, by_ns: i64) -> Self {
        match &mut self {
            Self::Imu(sample) => sample.time_ns -= by_ns,
            Self::Vio(vio) => {
                vio.from_ns -= by_ns;
                vio.to_ns -= by_ns;
            }
            Self::Anchor(anchor) => anchor.time_ns -= by_ns,
            Self::Fix(fix) => fix.time_ns -= by_ns,
            Self::Health(health) => health.time_ns -= by_ns,
        }
        self
    }

    /// Returns the input on a clock that is set back by `by_ns` at a time.
    pub(super) fn set_back(&self, jump_ns: i64, by_ns: i64) -> Self {
        self.behind(if self.time_ns() >= jump_ns { by_ns } else { 0 })
    }

    /// Returns a report on the receiver with another health. Any other input is returned as it is.
    pub(super) fn reporting(&self, health: GpsHealth) -> Self {
        match *self {
            Self::Health(reading) => Self::Health(GpsHealthReading { health, ..reading }),
            sent => sent,
        }
    }

    pub(super) fn to(&self, estimator: &mut Estimator) -> Result<(), EstimatorError> {
        match self {
            Self::Imu(sample) => estimator.add_imu(sample),
            Self::Vio(vio) => estimator.add_vio(*vio).map(drop),
            Self::Anchor(anchor) => estimator.add_pose_anchor(*anchor).map(drop),
            Self::Fix(fix) => estimator.add_gnss(*fix).map(drop),
            Self::Health(health) => estimator.add_gps_health(*health).map(drop),
        }
    }
}

/// An input with its result.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flown {
    /// Time of the input before it was changed.
    pub(super) at_ns: i64,
    pub(super) sent: Sent,
    pub(super) result: Result<(), EstimatorError>,
    /// Output of the tick that follows.
    pub(super) output: Option<EstimatorOutput>,
}

/// Measurements since the start.
pub(super) struct Flight {
    pub(super) frame: LocalFrame,
    pub(super) samples: Vec<ImuMean>,
    /// Accelerometer bias and gyroscope bias.
    pub(super) biases: [Vector3<f64>; 2],
    pub(super) vio: Vec<VioOutput>,
    /// One a second, between two frames.
    pub(super) anchors: Vec<PoseAnchor>,
    /// Five a second.
    pub(super) fixes: Vec<GnssReading>,
    /// Five a second, all stable.
    pub(super) health: Vec<GpsHealthReading>,
}

fn waves(waves: &[(f64, f64, f64)], t: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (amplitude, period, phase) in waves {
        let w = core::f64::consts::TAU / period;
        let (sin, cos) = (w * t + phase).sin_cos();
        sum[0] += amplitude * sin;
        sum[1] += amplitude * w * cos;
        sum[2] -= amplitude * w * w * sin;
    }
    sum
}

/// Position, velocity, acceleration.
fn motion(t: f64) -> [Vector3<f64>; 3] {
    let x = waves(&[(20.0, 23.0, 0.3)], t);
    let y = waves(&[(80.0, 40.0, 0.0), (8.0, 11.0, 1.0)], t);
    let z = waves(&[(10.0, 31.0, 0.5), (3.0, 9.0, 0.0)], t);
    let mut all: [Vector3<f64>; 3] = core::array::from_fn(|i| Vector3::new(x[i], y[i], z[i]));
    all[0].x += 15.0 * t;
    all[1].x += 15.0;
    all
}

/// The direction of thrust follows from the acceleration.
fn attitude(t: f64) -> UnitQuaternion<f64> {
    let [_, velocity, acceleration] = motion(t);
    let up = (acceleration + Vector3::new(0.0, 0.0, GRAVITY)).normalize();
    let ahead = (velocity - up * velocity.dot(&up)).normalize();
    let rotation = Matrix3::from_columns(&[ahead, up.cross(&ahead), up]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))
}

fn seconds(time_ns: i64) -> f64 {
    time_ns as f64 * 1e-9
}

fn diagonal(first: f64, second: f64) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| if i != j { 0.0 } else { (if i < 3 { first } else { second }).powi(2) })
}

impl Flight {
    pub(super) fn truth(time_ns: i64) -> State {
        let [position, velocity, _] = motion(seconds(time_ns));
        State { position, velocity, world_from_body: attitude(seconds(time_ns)) }
    }

    /// The relative pose between two times, without noise.
    pub(super) fn relative(from_ns: i64, to_ns: i64) -> VioOutput {
        let (from, to) = (Self::truth(from_ns), Self::truth(to_ns));
        let back = from.world_from_body.inverse();
        let (translation, from_to) = (back * (to.position - from.position), back * to.world_from_body);
        VioOutput { from_ns, to_ns, translation, from_to, covariance: diagonal(0.01, 1e-3), bias: None }
    }

    pub(super) fn new(length_s: i64, seed: u64) -> Self {
        let mut noise = Noise::new(seed);
        let [gyroscope_bias, accelerometer_bias] = [noise.vector(0.01), noise.vector(0.1)];
        let frame = LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0));
        let end = length_s * SECOND;
        let samples = (1..=end / STEP).map(|i| {
            let (from, to) = (seconds((i - 1) * STEP), seconds(i * STEP));
            let dt = to - from;
            let turn = rotation_vector(&(attitude(from).inverse() * attitude(to)));
            let part = |j: i32| {
                let t = from + (f64::from(j) + 0.5) / 5.0 * dt;
                attitude(t).inverse() * (motion(t)[2] + Vector3::new(0.0, 0.0, GRAVITY))
            };
            let force = (0..5).map(part).sum::<Vector3<f64>>() / 5.0;
            let white = 1.0 / dt.sqrt();
            ImuMean {
                time_ns: i * STEP,
                angular_velocity: turn / dt + gyroscope_bias + noise.vector(1.7e-4 * white),
                specific_force: force + accelerometer_bias + noise.vector(2e-3 * white),
            }
        });
        let samples = samples.collect();
        let vio = (1..=end / FRAME).map(|i| {
            let (from_ns, to_ns) = ((i - 1) * FRAME, i * FRAME);
            let VioOutput { translation, from_to, .. } = Self::relative(from_ns, to_ns);
            VioOutput {
                translation: translation + noise.vector(0.02),
                from_to: from_to * rotation(&noise.vector(1e-3)),
                covariance: diagonal(0.02, 1e-3),
                ..Self::relative(from_ns, to_ns)
            }
        });
        let vio = vio.collect();
        let local = |state: &State| {
            let position = frame.geodetic(&state.position);
            (position, frame.other_from_self(&LocalFrame::new(position)).rotation)
        };
        let anchors = (1..length_s).map(|i| {
            let time_ns = i * SECOND + 3 * STEP;
            let truth = Self::truth(time_ns);
            let (_, turn) = local(&truth);
            let position = frame.geodetic(&(truth.position + noise.vector(1.5)));
            let world_from_body = turn * rotation(&noise.vector(0.03)) * truth.world_from_body;
            let covariance = diagonal(1.5, 0.03);
            PoseAnchor {
                time_ns,
                provider: 0,
                position,
                world_from_body,
                covariance,
                is_covariance_degraded: false,
            }
        });
        let anchors = anchors.collect();
        let fixes = (1..5 * length_s).map(|i| {
            let time_ns = i * SECOND / 5 + STEP / 2;
            let truth = Self::truth(time_ns);
            let position = frame.geodetic(&(truth.position + noise.vector(2.0)));
            GnssReading {
                time_ns,
                position,
                covariance: Matrix3::identity() * 4.0,
                velocity: Some((local(&truth).1 * truth.velocity + noise.vector(0.2), Matrix3::identity() * 0.04)),
                lever_arm: Vector3::zeros(),
            }
        });
        let fixes = fixes.collect();
        let health =
            (0..5 * length_s).map(|i| GpsHealthReading { time_ns: i * SECOND / 5, health: GpsHealth::Stable });
        let biases = [accelerometer_bias, gyroscope_bias];
        Self { frame, samples, biases, vio, anchors, fixes, health: health.collect() }
    }

    /// The flight controller's state at a time: close to the truth.
    pub(super) fn warm_start(&self, time_ns: i64) -> FlightControllerState {
        let truth = Self::truth(time_ns);
        let (tilt_deviation, heading_deviation) = (0.01, 0.03);
        FlightControllerState {
            attitude: AttitudeReading {
                time_ns,
                world_from_body: rotation(&Vector3::new(0.01, -0.005, 0.02)) * truth.world_from_body,
                tilt_deviation,
                heading_deviation,
            },
            position: self.frame.geodetic(&(truth.position + Vector3::new(0.6, -0.8, 0.5))),
            position_covariance: Matrix3::identity(),
            velocity: truth.velocity + Vector3::new(0.1, 0.1, -0.1),
            velocity_covariance: Matrix3::identity() * 0.04,
        }
    }

    /// All inputs after the first sample, ordered by stamp. The camera, anchors and receiver are included on request.
    pub(super) fn sent(&self, with_vio: bool, with_anchors: bool, with_gnss: bool) -> Vec<Sent> {
        let mut sent: Vec<Sent> = self.samples.iter().skip(1).copied().map(Sent::Imu).collect();
        if with_vio {
            sent.extend(self.vio.iter().copied().map(Sent::Vio));
        }
        if with_anchors {
            sent.extend(self.anchors.iter().copied().map(Sent::Anchor));
        }
        if with_gnss {
            sent.extend(self.fixes.iter().copied().map(Sent::Fix));
            sent.extend(self.health.iter().copied().map(Sent::Health));
        }
        sent.sort_by_key(Sent::time_ns);
        sent
    }

    /// A position that is moved, m.
    pub(super) fn moved(&self, position: &Geodetic, by: Vector3<f64>) -> Geodetic {
        self.frame.geodetic(&(self.frame.position(position) + by))
    }

    /// A fix or an anchor that is moved, m. Any other input is returned as it is.
    pub(super) fn moving(&self, sent: &Sent, by: Vector3<f64>) -> Sent {
        match *sent {
            Sent::Fix(fix) => Sent::Fix(GnssReading { position: self.moved(&fix.position, by), ..fix }),
            Sent::Anchor(anchor) => {
                Sent::Anchor(PoseAnchor { position: self.moved(&anchor.position, by), ..anchor })
            }
            sent => sent,
        }
    }

    /// Difference of a position from the truth, m.
    pub(super) fn off(&self, output: &EstimatorOutput) -> Vector3<f64> {
        self.frame.position(&output.position) - Self::truth(output.time_ns).position
    }

    /// Size of the error of a velocity, in the axes of the place, m/s.
    pub(super) fn velocity_error(&self, output: &EstimatorOutput) -> f64 {
        let turn = self.frame.other_from_self(&LocalFrame::new(output.position)).rotation;
        (output.velocity - turn * Self::truth(output.time_ns).velocity).norm()
    }

    /// Position error, m, and rotation error, rad, of an estimate at its time.
    pub(super) fn error(&self, output: &EstimatorOutput) -> (f64, f64) {
        let truth = Self::truth(output.time_ns);
        let turn = self.frame.other_from_self(&LocalFrame::new(output.position)).rotation;
        let turned = output.world_from_body * (turn * truth.world_from_body).inverse();
        (self.off(output).norm(), rotation_vector(&turned).norm())
    }
}
