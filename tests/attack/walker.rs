//! A phone in the pocket of a walker: a thigh that swings, in a field that changes with the place, with a magnetometer that lags.

use super::{DEGREE, Moment, Outcome, Sensors, Sines, Vectors, is, log_uniform, noise, score, uniform};
use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_tests::random::Random;
use std::f64::consts::TAU;

/// Speed, m/s, and the length of a thigh, m.
const SPEED: f64 = 1.3;
const THIGH: f64 = 0.3;

/// A gait, in terms of the time that has been walked.
struct Gait {
    mount: UnitQuaternion<f64>,
    /// Frequency of two steps, Hz, and the swing of the thigh at it and at twice of it, rad, with a phase.
    step_hz: f64,
    swing: f64,
    second: f64,
    phase: f64,
    /// Amplitudes of the turn and the lean of the hip, rad.
    yaw: f64,
    roll: f64,
    first_heading: f64,
    turns: Sines,
}

impl Gait {
    fn new(random: &mut Random) -> Self {
        let mount = UnitQuaternion::from_scaled_axis(noise(random) * 1.5);
        let (swing, step_hz) = (uniform(random, (0.3, 0.65)), uniform(random, (0.75, 1.05)));
        let (second, phase) = (uniform(random, (0.0, 0.25)) * swing, uniform(random, (0.0, TAU)));
        let (yaw, roll) = (uniform(random, (0.03, 0.15)), uniform(random, (0.02, 0.1)));
        let size = log_uniform(random, (0.05, 2.0));
        let turns = Sines::new(random, size, (0.01, 0.1));
        let first_heading = uniform(random, (0.0, TAU));
        Self { mount, step_hz, swing, second, phase, yaw, roll, first_heading, turns }
    }

    fn heading(&self, walked_s: f64) -> f64 {
        self.first_heading + self.turns.at(walked_s)
    }

    /// Angle within two steps, and of the thigh.
    fn angles(&self, walked_s: f64) -> (f64, f64) {
        let angle = TAU * self.step_hz * walked_s;
        (angle, 0.1 + self.swing * angle.sin() + self.second * (2.0 * angle + self.phase).sin())
    }

    fn world_from_body(&self, walked_s: f64) -> UnitQuaternion<f64> {
        let (angle, thigh) = self.angles(walked_s);
        let heading = self.heading(walked_s) + self.yaw * angle.cos();
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        let pitch = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), thigh);
        let lean = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.roll * (angle + 1.0).sin());
        heading * pitch * lean * self.mount
    }

    /// Position of the knee about the steady way of the walker.
    fn knee(&self, walked_s: f64) -> Vector3<f64> {
        let (angle, thigh) = self.angles(walked_s);
        let along = SPEED * 0.1 * (2.0 * angle).sin() / (2.0 * TAU * self.step_hz) - THIGH * thigh.sin();
        let up = 0.03 * (2.0 * angle).cos() - THIGH * thigh.cos();
        let heading = self.heading(walked_s);
        Vector3::new(-heading.sin() * along, heading.cos() * along, up)
    }
}

/// A walker of a seed, with a lag of up to 20 ms, who waits first and perhaps rests now and then.
pub(super) fn walker(seed: u64) -> Outcome {
    let random = &mut Random::new(seed ^ 0x5EED_0000);
    let length_s = uniform(random, (60.0, 240.0));
    let mut sensors = Sensors::new(random);
    sensors.lag_s = uniform(random, (0.0, 0.02));
    let (norm, dip) = (uniform(random, (30e-6, 60e-6)), uniform(random, (-70.0, 70.0)) * DEGREE);
    let earth = Vector3::new(0.0, norm * dip.cos(), norm * dip.sin());
    let places = log_uniform(random, (0.5e-6, 7e-6)) / 3_f64.sqrt();
    let field = Vectors::new(random, Vector3::repeat(places), (0.02, 0.3));
    let magnet = match uniform(random, (0.0, 1.0)) {
        part if part < 0.5 => noise(random) * 1e-6,
        part if part < 0.8 => noise(random) * log_uniform(random, (3e-6, 60e-6)),
        _ => Vector3::zeros(),
    };
    let gait = Gait::new(random);
    let (stands_s, moves_s) = (uniform(random, (0.0, 8.0)), uniform(random, (15.0, 60.0)));
    let rests_s = if is(random, 0.5) { uniform(random, (2.0, 10.0)) } else { 0.0 };
    let pace = |since_s: f64| {
        if since_s < 0.0 {
            return 0.0;
        }
        if rests_s == 0.0 {
            return since_s.min(1.0);
        }
        let since_s = since_s % (moves_s + rests_s);
        since_s.min(1.0).min((moves_s - since_s).clamp(0.0, 1.0))
    };
    let mut walked_s = 0.0;
    let mut truth = gait.world_from_body(0.0);
    let mut knees = [gait.knee(0.0); 2];
    score(
        random,
        (length_s, 0.005),
        &sensors,
        |_| magnet,
        |time_s, step_s| {
            walked_s += pace(time_s - stands_s) * step_s;
            let world_from_body = gait.world_from_body(walked_s);
            let turn = truth.inverse() * world_from_body;
            truth = world_from_body;
            let knee = gait.knee(walked_s);
            let acceleration = (knee - knees[1] * 2.0 + knees[0]) / (step_s * step_s);
            knees = [knees[1], knee];
            Moment { world_from_body, turn, field: earth + field.at(walked_s), acceleration }
        },
    )
}
