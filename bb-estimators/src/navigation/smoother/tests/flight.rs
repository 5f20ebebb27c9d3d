//! A simulated flight, with the noise that the smoother is told, or none.

use nalgebra::{UnitQuaternion, Vector3};

use crate::navigation::math::rotation;
use crate::navigation::noise::Noise;
use crate::navigation::{
    AbsolutePose, EskfParams, Estimate, FixedLagSmoother, GaussMarkov, GnssPosition, GnssVelocity, ImuMean,
    NavigationFactor, Optional, RelativePose, SmootherParams, Start, States,
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

/// The true flight and its measurements.
pub(super) struct Flight {
    pub(super) start: Start,
    /// The samples that end at keyframe k, from 1 on.
    pub(super) samples: Vec<Vec<ImuMean>>,
    /// The measurements at keyframe k.
    pub(super) measured: Vec<Vec<NavigationFactor>>,
    /// The truth at keyframe k.
    pub(super) truth: Vec<Truth>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Truth {
    pub(super) position: Vector3<f64>,
    pub(super) velocity: Vector3<f64>,
    pub(super) world_from_body: UnitQuaternion<f64>,
    pub(super) accelerometer_bias: Vector3<f64>,
    pub(super) gyroscope_bias: Vector3<f64>,
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
        let mut truth = Truth {
            position: draw(1.0),
            velocity: velocity + draw(0.3),
            world_from_body: rotation(&draw(0.05)) * level_start,
            accelerometer_bias: draw(0.1),
            gyroscope_bias: draw(0.01),
        };
        let mut scale = draw(0.02).x;
        let lever_arm = draw(0.2);
        let mut flight = Self { start, samples: vec![vec![]], measured: vec![vec![]], truth: vec![truth] };
        for k in 1..keyframes as i64 {
            let before = truth;
            let mut samples = Vec::new();
            for i in (k - 1) * SAMPLES + 1..=k * SAMPLES {
                let ImuMean { time_ns, angular_velocity, specific_force } = sample(i);
                let mut motion = crate::navigation::Preintegration::new(Vector3::zeros(), Vector3::zeros());
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
            let back = before.world_from_body.inverse();
            let way = back * (truth.position - before.position) * (1.0 + scale) + draw(0.05);
            let turn = back * truth.world_from_body * rotation(&draw(2e-3));
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
            let (from, to) = (self.truth[k - span], self.truth[k]);
            let back = from.world_from_body.inverse();
            let way = back * (to.position - from.position) + noise.vector(0.05);
            let turn = back * to.world_from_body * rotation(&noise.vector(2e-3));
            let pose = RelativePose::new((k - span) as u64, (way, 0.05), (turn, 2e-3));
            self.measured[k].push(NavigationFactor::Between(pose));
        }
        self
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

    /// Flies the whole flight, with an update at each keyframe.
    pub(super) fn flown(&self, params: SmootherParams) -> Smoother {
        let mut smoother = Smoother::new(params).unwrap();
        smoother.start(0, &self.start).unwrap();
        for k in 1..self.samples.len() {
            self.fly_to(&mut smoother, k);
            self.measure(&mut smoother, k);
            smoother.update().unwrap();
        }
        smoother
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

    pub(super) fn error(&self, k: usize, estimate: &Estimate<N>) -> nalgebra::SVector<f64, 15> {
        let truth = &self.truth[k];
        let mut error = nalgebra::SVector::<f64, 15>::zeros();
        let mut set = |first: usize, part: Vector3<f64>| error.fixed_rows_mut::<3>(first).copy_from(&part);
        set(0, truth.position - estimate.position);
        set(3, truth.velocity - estimate.velocity);
        set(6, (truth.world_from_body * estimate.world_from_body.inverse()).scaled_axis());
        set(9, truth.accelerometer_bias - estimate.accelerometer_bias);
        set(12, truth.gyroscope_bias - estimate.gyroscope_bias);
        error
    }
}

/// A stream without a gate.
pub(super) fn open() -> crate::navigation::Stream {
    crate::navigation::Stream::new(crate::navigation::StreamParams {
        gate: 0.0,
        ..crate::navigation::StreamParams::default()
    })
}

/// A flight that turns and accelerates, sampled at 100 Hz.
pub(super) fn sample(i: i64) -> ImuMean {
    let t = i as f64 * DT;
    ImuMean {
        time_ns: i * DT_NS,
        angular_velocity: Vector3::new(0.3 * t.sin(), 0.2 * (1.3 * t).cos(), 0.4 * (0.7 * t).sin()),
        specific_force: Vector3::new(t.cos(), (0.8 * t).sin(), 9.8 + 0.5 * (0.5 * t).sin()),
    }
}
