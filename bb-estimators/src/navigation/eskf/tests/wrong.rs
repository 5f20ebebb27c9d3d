//! A filter that is wrong and does not know it, as sensors leave it behind that were wrong for longer than their gates stayed closed.

use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use super::super::EskfParams;
use crate::navigation::noise::Noise;
use crate::navigation::{
    BarometricHeight, BodyVelocity, Eskf, GnssPosition, ImuMean, Navigation, ROTATION, Start, Stream, ZeroRotation,
};

const DT: f64 = 0.01;

/// Drives in a curve over hills, with fixes, wheels and a barometer that are right, after a start with an orientation that is wrong by
/// `turn`, a rotation vector in the world, of which the filter is sure. Returns the error of the tilt and that of the heading.
fn drive(seed: u64, turn: Vector3<f64>, seconds: f64) -> (f64, f64) {
    let mut noise = Noise::new(seed);
    let (speed, rate) = (noise.between(2.0, 12.0), noise.between(-0.15, 0.15));
    let params = EskfParams::default();
    let orientation = |time_s: f64| {
        Rotation3::from_euler_angles(0.1 * (0.9 * time_s).sin(), 0.1 * (0.4 * time_s).sin(), 0.3 + rate * time_s)
    };
    let mut world_from_body = orientation(0.0);
    let (mut position, mut velocity) = (Vector3::zeros(), world_from_body * Vector3::x() * speed);
    let mut filter = Eskf::<Navigation>::new(params).unwrap();
    let wrong = UnitQuaternion::from_scaled_axis(turn) * UnitQuaternion::from_rotation_matrix(&world_from_body);
    filter.start(&Start::at(0, (position, 0.5), (velocity, 0.1), (wrong, 0.01))).unwrap();
    let [mut gnss, mut wheels, mut pressure] = [Stream::default(); 3];
    for i in 1..=(seconds / DT) as i64 {
        let before = (world_from_body, velocity);
        world_from_body = orientation(i as f64 * DT);
        velocity = world_from_body * Vector3::x() * speed;
        position += (before.1 + velocity) * (0.5 * DT);
        let rate = (before.0.transpose() * world_from_body).scaled_axis() / DT;
        let middle = before.0 * Rotation3::from_scaled_axis(rate * (0.5 * DT));
        let force = middle.transpose() * ((velocity - before.1) / DT + Vector3::z() * params.gravity);
        let angular_velocity = rate + noise.vector(params.gyroscope_noise / DT.sqrt());
        let specific_force = force + noise.vector(params.accelerometer_noise / DT.sqrt());
        filter.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force }).unwrap();
        if i % 10 == 0 {
            let speed = BodyVelocity {
                velocity: Vector3::x() * speed + noise.vector(0.05),
                deviations: Vector3::repeat(0.05),
                body_from_sensor: UnitQuaternion::identity(),
                lever_arm: Vector3::zeros(),
            };
            let _ = filter.update(&mut wheels, &speed);
        }
        if i % 20 == 0 {
            let height = position.z + 0.5 * noise.next();
            let _ = filter.update(&mut pressure, &BarometricHeight { height, deviation: 0.5 });
        }
        if i % 100 == 0 {
            let _ = filter.update(&mut gnss, &GnssPosition::new(position + noise.vector(0.5), 0.5, 0.5));
        }
    }
    assert!(filter.is_consistent());
    let estimate = filter.estimate().unwrap();
    let error =
        (UnitQuaternion::from_rotation_matrix(&world_from_body) * estimate.world_from_body.inverse()).scaled_axis();
    (error.xy().norm(), error.z.abs())
}

/// Fixes do not observe the attitude, and wheels take the velocity to where a wrong one points. That it goes on, fix after fix, shows it.
/// The biases, which have followed it, need longer.
#[test]
fn an_attitude_that_is_wrong_for_no_known_reason_is_found() {
    let mut off = Vec::new();
    for seed in 0..40 {
        let mut noise = Noise::new(seed);
        let turn = Vector3::new(noise.between(-0.1, 0.1), noise.between(-0.1, 0.1), noise.between(-2.5, 2.5));
        let (tilt, heading) = drive(seed, turn, 150.0);
        if tilt > 0.05 || heading > 0.2 {
            off.push((turn, tilt, heading));
        }
    }
    assert!(off.len() <= 4, "{}: {off:?}", off.len());
}

/// A robot that turns by 0.2 rad/s while something says that it does not, and is at rest before and after. Returns the error of the
/// heading, its deviation, and that of the tilt.
fn turn_at_rest(seed: u64, wrong_s: f64, world: UnitQuaternion<f64>) -> (f64, f64, f64) {
    let mut noise = Noise::new(seed);
    let params = EskfParams::default();
    let mut filter = Eskf::<Navigation>::new(params).unwrap();
    let (mut heading, mut rotation) = (0.0, Stream::default());
    let origin = Vector3::zeros();
    filter.start(&Start::at(0, (origin, 0.5), (origin, 0.1), (world, 0.01))).unwrap();
    let last = ((50.0 + wrong_s) / DT) as i64;
    for i in 1..=last {
        let time_s = i as f64 * DT;
        let is_turning = (40.0..40.0 + wrong_s).contains(&time_s);
        let rate = if is_turning { 0.2 } else { 0.0 };
        heading += rate * DT;
        let angular_velocity = Vector3::new(0.0, 0.0, rate) + noise.vector(params.gyroscope_noise / DT.sqrt());
        let specific_force = Vector3::z() * params.gravity + noise.vector(params.accelerometer_noise / DT.sqrt());
        filter.propagate(&ImuMean { time_ns: i * 10_000_000, angular_velocity, specific_force }).unwrap();
        // Not while it starts and stops.
        if i % 10 == 0 && !(0.0..0.5).contains(&(time_s - 40.0 - wrong_s)) {
            let _ = filter.update(&mut rotation, &ZeroRotation { deviation: 0.005 });
        }
    }
    assert!(filter.is_consistent() && rotation.counts().recoveries >= 2, "{:?}", rotation.counts());
    let truth = world * UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
    let error = (truth * filter.estimate().unwrap().world_from_body.inverse()).scaled_axis();
    let deviation = |i: usize| filter.covariance()[(ROTATION + i, ROTATION + i)].sqrt();
    (error.z.abs(), deviation(2), deviation(0).max(deviation(1)))
}

/// A bias that jumps there and back has turned the heading meanwhile, but not the tilt.
#[test]
fn a_bias_that_jumps_back_makes_the_attitude_uncertain_by_as_much_as_it_has_turned() {
    for seed in 0..8 {
        let wrong_s = 2.0 + 0.5 * seed as f64;
        let world = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.4 * seed as f64);
        let (heading, deviation, tilt) = turn_at_rest(seed, wrong_s, world);
        assert!(heading > 0.2 && heading < 4.0 * deviation, "{seed}: {heading} rad, {deviation} rad");
        assert!(tilt < 0.1, "{seed}: {tilt} rad");
    }
}
