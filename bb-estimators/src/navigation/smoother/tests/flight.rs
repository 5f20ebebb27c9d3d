//! A simulated flight, with the noise that the smoother is told, or none.

use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};
use proptest::prelude::*;

pub(super) use crate::navigation::eskf::tests::{derivative, matrix, open, sample, vector};
use crate::navigation::math::rotation;
use crate::navigation::noise::Noise;
use crate::navigation::{
    AbsolutePose, EskfParams, Estimate, FixedLagSmoother, GaussMarkov, GnssPosition, GnssVelocity, ImuMean,
    NavigationFactor, Optional, Preintegration, RelativePose, SmootherParams, Start, States, nees,
};

/// A flight with a camera whose scale drifts and an antenna with an offset from its nominal position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Drone;

impl States for Drone {
    const OPTIONAL: &'static [Optional] = &[Optional::RelativeScale, Optional::GnssLeverArm];
}

pub(super) const N: usize = Drone::DIMENSION;

pub(super) type Smoother = FixedLagSmoother<Drone, N>;

/// The largest difference of two estimates, each component in its unit.
pub(super) fn apart(a: &Estimate<N>, b: &Estimate<N>) -> f64 {
    a.error_to::<Drone>(b).amax()
}

/// The largest difference of two covariances, relative to the variances.
pub(super) fn differ(a: &SMatrix<f64, N, N>, b: &SMatrix<f64, N, N>) -> f64 {
    let off = |i: usize, j: usize| (a[(i, j)] - b[(i, j)]).abs() / (a[(i, i)] * a[(j, j)]).sqrt();
    (0..N * N).map(|entry| off(entry / N, entry % N)).fold(0.0, f64::max)
}

/// The largest difference of two variances, as a fraction.
pub(super) fn variances_differ(a: &SMatrix<f64, N, N>, b: &SMatrix<f64, N, N>) -> f64 {
    (0..N).map(|i| (a[(i, i)] / b[(i, i)] - 1.0).abs()).fold(0.0, f64::max)
}

/// Checks that the estimates of each keyframe of `some` and `all` are apart by less than the first number, and its covariances, by the
/// measure that is given, by less than the second.
pub(super) fn agree(
    some: &Smoother,
    all: &Smoother,
    within: (f64, f64),
    difference: impl Fn(&SMatrix<f64, N, N>, &SMatrix<f64, N, N>) -> f64,
) -> Result<(), TestCaseError> {
    let (mut some, mut all) = (some.clone(), all.clone());
    for id in some.keyframes().collect::<Vec<_>>() {
        let off = apart(&all.smoothed(id).unwrap(), &some.smoothed(id).unwrap());
        prop_assert!(off < within.0, "{id}: {off}");
        let of_all = all.smoothed_covariance(id).unwrap();
        let off = difference(&of_all, &some.smoothed_covariance(id).unwrap());
        prop_assert!(off < within.1, "{id}: {off} of the covariance");
    }
    Ok(())
}

/// Number of samples between two keyframes, and their length.
pub(super) const SAMPLES: i64 = 10;
pub(super) const DT_NS: i64 = 10_000_000;
pub(super) const DT: f64 = 0.01;

pub(super) fn sensors() -> EskfParams {
    EskfParams {
        gyroscope_noise: 1e-3,
        accelerometer_noise: 1e-2,
        gyroscope_bias_walk: 1e-4,
        accelerometer_bias_walk: 3e-3,
        relative_scale: GaussMarkov::new(0.02, 20.0),
        gnss_lever_arm: GaussMarkov::constant(0.2),
        ..EskfParams::default()
    }
}

/// Linear: every keyframe keeps its first linearisation point.
pub(super) fn linear(window: usize) -> SmootherParams {
    SmootherParams { sensors: sensors(), window, iterations: 0, ..SmootherParams::default() }
}

/// Iterates to convergence.
pub(super) fn converged(window: usize) -> SmootherParams {
    SmootherParams { relinearise_rotation: 0.0, relinearise_position: 0.0, iterations: 20, ..linear(window) }
}

/// The smoother's defaults with a window of this many keyframes.
pub(super) fn usual(window: usize) -> SmootherParams {
    SmootherParams { sensors: sensors(), window, ..SmootherParams::default() }
}

/// The true flight and its measurements.
pub(super) struct Flight {
    pub(super) start: Start,
    /// The samples that end at keyframe k, from 1 on.
    pub(super) samples: Vec<Vec<ImuMean>>,
    /// The measurements at keyframe k.
    pub(super) measured: Vec<Vec<NavigationFactor>>,
    /// The truth at keyframe k.
    pub(super) truth: Vec<Estimate<N>>,
}

/// The displacement and rotation from one pose to another, in the axes of the first.
fn relative(from: &Estimate<N>, to: &Estimate<N>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let back = from.world_from_body.inverse();
    (back * (to.position - from.position), back * to.world_from_body)
}

impl Flight {
    /// A flight of `keyframes` keyframes, with noise of `level` times the smoother's.
    pub(super) fn new(seed: u64, keyframes: usize, level: f64) -> Self {
        let params = sensors();
        let mut noise = Noise::new(seed);
        let mut draw = |deviation: f64| noise.vector(deviation * level);
        let level_start = UnitQuaternion::from_euler_angles(0.1, -0.1, 1.0);
        let velocity = Vector3::new(8.0, 2.0, 0.0);
        let start = Start {
            accelerometer_bias_deviation: 0.1,
            gyroscope_bias_deviation: 0.01,
            ..Start::at(0, (Vector3::zeros(), 1.0), (velocity, 0.3), (level_start, 0.05))
        };
        let mut truth = Estimate {
            position: draw(1.0),
            velocity: velocity + draw(0.3),
            world_from_body: rotation(&draw(0.05)) * level_start,
            accelerometer_bias: draw(0.1),
            gyroscope_bias: draw(0.01),
            ..Estimate::unknown()
        };
        let mut scale = draw(0.02).x;
        let lever_arm = draw(0.2);
        let mut flight = Self { start, samples: vec![vec![]], measured: vec![vec![]], truth: vec![truth] };
        for k in 1..keyframes as i64 {
            let before = truth;
            let mut samples = Vec::new();
            for i in (k - 1) * SAMPLES + 1..=k * SAMPLES {
                let ImuMean { time_ns, angular_velocity, specific_force } = sample(i);
                let mut motion = Preintegration::new(Vector3::zeros(), Vector3::zeros());
                motion.add(&angular_velocity, &specific_force, DT, &params.densities());
                let fall = Vector3::new(0.0, 0.0, -params.gravity * DT);
                truth.position +=
                    truth.velocity * DT + truth.world_from_body * motion.position() + fall * (0.5 * DT);
                truth.velocity += truth.world_from_body * motion.velocity() + fall;
                truth.world_from_body *= motion.rotation();
                samples.push(ImuMean {
                    time_ns,
                    angular_velocity: angular_velocity
                        + truth.gyroscope_bias
                        + draw(params.gyroscope_noise / DT.sqrt()),
                    specific_force: specific_force
                        + truth.accelerometer_bias
                        + draw(params.accelerometer_noise / DT.sqrt()),
                });
                truth.gyroscope_bias += draw(params.gyroscope_bias_walk * DT.sqrt());
                truth.accelerometer_bias += draw(params.accelerometer_bias_walk * DT.sqrt());
            }
            let GaussMarkov { deviation, time_s } = params.relative_scale;
            let kept = (-(SAMPLES as f64) * DT / time_s).exp();
            scale = scale * kept + draw(deviation * (1.0 - kept * kept).sqrt()).x;
            let (way, turn) = relative(&before, &truth);
            let (way, turn) = (way * (1.0 + scale) + draw(0.05), turn * rotation(&draw(2e-3)));
            let id = u64::try_from(k - 1).unwrap();
            let mut measured = vec![RelativePose::new(id, (way, 0.05), (turn, 2e-3)).into()];
            if k % 5 == 0 {
                let antenna = truth.position + truth.world_from_body * lever_arm;
                measured.push(GnssPosition::new(antenna + draw(0.8), 0.8, 0.8).into());
                let swing = truth.world_from_body * sample(k * SAMPLES).angular_velocity.cross(&lever_arm);
                measured.push(GnssVelocity::new(truth.velocity + swing + draw(0.1), 0.1, 0.1).into());
            }
            if k % 7 == 0 {
                let turned = rotation(&draw(0.03)) * truth.world_from_body;
                measured.push(AbsolutePose::new((truth.position + draw(2.0), 2.0), (turned, 0.03)).into());
            }
            flight.samples.push(samples);
            flight.measured.push(measured);
            flight.truth.push(truth);
        }
        flight
    }

    /// Adds a relative pose to an earlier keyframe, at most `most` before, at about every second keyframe. If `most` is below 2, it adds nothing.
    pub(super) fn related(mut self, seed: u64, most: usize) -> Self {
        let mut noise = Noise::new(seed);
        for k in 2..self.truth.len() {
            let span = 2 + (noise.next().abs() * 10.0) as usize % (2 * most).max(1);
            if span > most.min(k) {
                continue;
            }
            let off = (noise.vector(0.05), noise.vector(2e-3));
            let pose = self.relative_pose(k - span, k, &off.0, &off.1);
            self.measured[k].push(NavigationFactor::Between(pose));
        }
        self
    }

    /// The pose of one keyframe relative to an earlier one, with these errors.
    pub(super) fn relative_pose(
        &self,
        from: usize,
        to: usize,
        off: &Vector3<f64>,
        off_rotation: &Vector3<f64>,
    ) -> RelativePose {
        let (way, turn) = relative(&self.truth[from], &self.truth[to]);
        RelativePose::new(from as u64, (way + off, 0.05), (turn * rotation(off_rotation), 2e-3))
    }

    /// Returns the flight in a world that is turned about its origin, and then moved.
    pub(super) fn elsewhere(mut self, turn: &UnitQuaternion<f64>, origin: &Vector3<f64>) -> Self {
        let place = |position: &Vector3<f64>| turn * position + origin;
        let start = &mut self.start;
        start.position = place(&start.position);
        start.velocity = turn * start.velocity;
        start.world_from_body = turn * start.world_from_body;
        for factor in self.measured.iter_mut().flatten() {
            match factor {
                NavigationFactor::GnssPosition(fix) => fix.position = place(&fix.position),
                NavigationFactor::GnssVelocity(fix) => fix.velocity = turn * fix.velocity,
                NavigationFactor::AbsolutePose(pose) => {
                    pose.position = place(&pose.position);
                    pose.world_from_body = turn * pose.world_from_body;
                }
                _ => {}
            }
        }
        self
    }

    /// A smoother at the start of the flight.
    pub(super) fn begun(&self, params: SmootherParams) -> Smoother {
        let mut smoother = Smoother::new(params).unwrap();
        smoother.start(0, &self.start).unwrap();
        smoother
    }

    /// Flies the whole flight, with an update at each keyframe.
    pub(super) fn flown(&self, params: SmootherParams) -> Smoother {
        let mut smoother = self.begun(params);
        for k in 1..self.samples.len() {
            self.advance(&mut smoother, k);
            smoother.update().unwrap();
        }
        smoother
    }

    /// Flies to keyframe k and adds its measurements.
    pub(super) fn advance(&self, smoother: &mut Smoother, k: usize) {
        self.fly_to(smoother, k);
        self.measure(smoother, k);
    }

    /// Flies from keyframe k - 1 to keyframe k, which is added.
    pub(super) fn fly_to(&self, smoother: &mut Smoother, k: usize) {
        for sample in &self.samples[k] {
            smoother.propagate(sample).unwrap();
        }
        smoother.add_keyframe(k as u64).unwrap();
    }

    /// Adds the measurements at keyframe k, ungated.
    pub(super) fn measure(&self, smoother: &mut Smoother, k: usize) {
        for factor in &self.measured[k] {
            smoother.add(&mut open(), k as u64, *factor).unwrap();
        }
    }

    /// The error of the navigation states at keyframe k.
    pub(super) fn error(&self, k: usize, estimate: &Estimate<N>) -> SVector<f64, 15> {
        estimate.error_to::<Drone>(&self.truth[k]).fixed_rows::<15>(0).into_owned()
    }

    /// The normalised error at keyframe k.
    pub(super) fn nees(&self, k: usize, smoother: &Smoother) -> f64 {
        let mut smoother = smoother.clone();
        let covariance = smoother.smoothed_covariance(k as u64).unwrap().fixed_view::<15, 15>(0, 0).into_owned();
        nees(&self.error(k, &smoother.smoothed(k as u64).unwrap()), &covariance).unwrap()
    }
}
