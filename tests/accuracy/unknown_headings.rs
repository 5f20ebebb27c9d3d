//! Cars that start in motion with a heading that nobody knows: how soon it is known, and whether it is ever trusted while it is wrong.

use bb_core::nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::{GeodeticPosition, GnssFix, GnssServices, GnssStatus, Orientation, Twist};
use bb_core::prelude::*;
use bb_estimators::Eskf;
use bb_estimators::navigation::{Geodetic, LocalFrame, NavigationOutputs};
use bb_tests::random::Random;
use std::f64::consts::TAU;

robot! {
    robot Car;

    link base {
        sensor imu: External<Imu>();
        sensor gnss: External<GnssFix>();
        sensor velocity: External<Twist>();
        sensor antennas: External<Orientation>();
        sensor wheels: External<Odometry>();
        estimator fixes: Eskf<NavigationOutputs>() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            output odometry; output status;
        }
        estimator wheeled: Eskf<NavigationOutputs>() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input odometry: sensor::base::wheels, optional;
            output odometry; output status;
        }
        estimator mounted: Eskf<NavigationOutputs>(wheel_mounting = 1 deg) {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input odometry: sensor::base::wheels, optional;
            output odometry; output status;
        }
        estimator with_velocity: Eskf<NavigationOutputs>() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input gnss_velocity: sensor::base::velocity, optional;
            output odometry; output status;
        }
        estimator with_heading: Eskf<NavigationOutputs>() {
            input imu: sensor::base::imu, driver;
            input gnss: sensor::base::gnss, optional;
            input gnss_heading: sensor::base::antennas, optional;
            output odometry; output status;
        }
    }
}

const CARS: u64 = 6;
const STEP_S: f64 = 0.01;
const STEPS: usize = 6000;

/// The filters, and the time by which each has to know the headings of all cars, s.
const FILTERS: [(&str, f64); 5] =
    [("fixes", 60.0), ("wheeled", 15.0), ("mounted", 15.0), ("with_velocity", 30.0), ("with_heading", 5.0)];

fn normal(random: &mut Random, deviation: f64) -> f64 {
    (0..12).map(|_| random.noise()).sum::<f64>() * deviation / 12_f64.sqrt()
}

fn vector(random: &mut Random, deviation: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(random, deviation))
}

/// The way of a car: speed and rate of turn wander, and it rolls and pitches a little.
struct Way {
    positions: Vec<Vector3<f64>>,
    velocities: Vec<Vector3<f64>>,
    rotations: Vec<UnitQuaternion<f64>>,
}

impl Way {
    fn new(random: &mut Random) -> Self {
        let mut phase = || TAU * random.below(1 << 20) as f64 / f64::from(1 << 20);
        let [of_speed, of_turn, of_wiggle, mut yaw] = [phase(), phase(), phase(), phase()];
        let speed = |t: f64| 6.0 + 2.0 * (0.15 * t + of_speed).sin();
        let rate = |t: f64| 0.25 * (0.3 * t + of_turn).sin() + 0.1 * (0.8 * t + of_wiggle).sin();
        let mut way = Self { positions: vec![], velocities: vec![], rotations: vec![] };
        let mut position = Vector3::zeros();
        for step in 0..=STEPS {
            let t = step as f64 * STEP_S;
            let velocity = Vector3::new(yaw.cos(), yaw.sin(), 0.0) * speed(t);
            way.positions.push(position);
            way.velocities.push(velocity);
            let (roll, pitch) = (0.05 * (0.5 * t).sin(), 0.04 * (0.4 * t + 1.0).sin());
            way.rotations.push(UnitQuaternion::from_euler_angles(roll, pitch, yaw));
            yaw += rate(t) * STEP_S;
            let next = Vector3::new(yaw.cos(), yaw.sin(), 0.0) * speed(t + STEP_S);
            position += (velocity + next) * (0.5 * STEP_S);
        }
        way
    }
}

/// Fate of a heading.
#[derive(Clone, Copy, Debug, Default)]
struct Score {
    /// The last time without an estimate, or with a heading that is off by more than 5°, s.
    unknown_s: f64,
    /// Estimates while healthy, and those of them that are off by more than four deviations.
    healthy: u32,
    beyond: u32,
}

fn drive(seed: u64) -> [Score; FILTERS.len()] {
    let mut random = Random::new(seed);
    let Way { positions, velocities, rotations } = Way::new(&mut random);
    let builder = Car::builder();
    let room = || Overflow::DropOldest { capacity: 16 };
    let outputs = [
        (
            builder.subscribe_with(car::estimator::base::fixes::odometry, room()),
            builder.subscribe_with(car::estimator::base::fixes::status, room()),
        ),
        (
            builder.subscribe_with(car::estimator::base::wheeled::odometry, room()),
            builder.subscribe_with(car::estimator::base::wheeled::status, room()),
        ),
        (
            builder.subscribe_with(car::estimator::base::mounted::odometry, room()),
            builder.subscribe_with(car::estimator::base::mounted::status, room()),
        ),
        (
            builder.subscribe_with(car::estimator::base::with_velocity::odometry, room()),
            builder.subscribe_with(car::estimator::base::with_velocity::status, room()),
        ),
        (
            builder.subscribe_with(car::estimator::base::with_heading::odometry, room()),
            builder.subscribe_with(car::estimator::base::with_heading::status, room()),
        ),
    ];
    let health = builder.subscribe_with(system::Health, room());
    let mut simulation = builder.simulate().expect("it starts");
    let frame = LocalFrame::new(Geodetic::from_degrees(48.0, 11.0, 500.0));
    let biases = [vector(&mut random, 0.005), vector(&mut random, 0.05)];
    let (mut scores, mut is_healthy) = ([Score::default(); FILTERS.len()], [true; FILTERS.len()]);
    for step in 1..STEPS {
        let time = MonotonicTime::ZERO + Duration::from_millis(10 * step as u64);
        let level = UnitQuaternion::identity();
        if step.is_multiple_of(5) {
            let linear = rotations[step].inverse() * velocities[step] + vector(&mut random, 0.1);
            let pose = Pose { position: positions[step], world_from_body: level, covariance: None };
            let twist = Twist { linear, angular: Vector3::zeros(), covariance: None };
            simulation.publish(car::sensor::base::wheels, time, Odometry { pose, twist });
        }
        if step.is_multiple_of(100) {
            let Geodetic { latitude, longitude, height } =
                frame.geodetic(&(positions[step] + vector(&mut random, 1.0)));
            let fix = GnssFix {
                status: GnssStatus::Fix,
                services: GnssServices::default(),
                position: Some(GeodeticPosition {
                    latitude_rad: latitude,
                    longitude_rad: longitude,
                    altitude: Some(height),
                }),
                position_covariance: Some(Matrix3::identity()),
            };
            simulation.publish(car::sensor::base::gnss, time, fix);
            let linear = velocities[step] + vector(&mut random, 0.1);
            let twist = Twist { linear, angular: Vector3::zeros(), covariance: Some(Matrix6::identity() * 0.01) };
            simulation.publish(car::sensor::base::velocity, time, twist);
            let heading = rotations[step].euler_angles().2 + normal(&mut random, 0.02);
            let world_from_body = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
            let antennas = Orientation { world_from_body, covariance: Some(Matrix3::identity() * 4e-4) };
            simulation.publish(car::sensor::base::antennas, time, antennas);
        }
        let acceleration = (velocities[step] - velocities[step - 1]) / STEP_S + Vector3::new(0.0, 0.0, 9.80665);
        let turn = (rotations[step - 1].inverse() * rotations[step]).scaled_axis() / STEP_S;
        let force = rotations[step].inverse() * acceleration + biases[1] + vector(&mut random, 0.05);
        let sample = Imu::new(turn + biases[0] + vector(&mut random, 0.002), force);
        simulation.publish(car::sensor::base::imu, time, sample);
        for change in health.drain() {
            let of =
                FILTERS.iter().position(|(name, _)| change.payload.estimator.ends_with(name)).expect("one of them");
            is_healthy[of] = change.payload.to == HealthState::Healthy;
        }
        for ((score, is_healthy), (odometry, status)) in scores.iter_mut().zip(is_healthy).zip(&outputs) {
            let estimate = odometry.drain().last().zip(status.drain().last());
            let off = estimate.map(|(odometry, status)| {
                let off = (odometry.pose.world_from_body * rotations[step].inverse()).scaled_axis().z.abs();
                (off, status.heading_deviation)
            });
            if off.is_none_or(|(off, _)| off > 5_f64.to_radians()) {
                score.unknown_s = step as f64 * STEP_S;
            }
            if let Some((off, deviation)) = off.filter(|_| is_healthy) {
                score.healthy += 1;
                score.beyond += u32::from(off > 4.0 * deviation);
            }
        }
    }
    scores
}

#[test]
fn unknown_headings_are_found() {
    let cars: Vec<_> = (0..CARS).map(drive).collect();
    for (filter, (name, known_s)) in FILTERS.into_iter().enumerate() {
        let scores: Vec<_> = cars.iter().map(|scores| scores[filter]).collect();
        let mut times: Vec<_> = scores.iter().map(|score| score.unknown_s).collect();
        times.sort_by(f64::total_cmp);
        let [healthy, beyond] = [|score: &Score| score.healthy, |score: &Score| score.beyond]
            .map(|of| scores.iter().map(of).sum::<u32>());
        println!("{name}: within 5° after {times:.1?} s; {beyond} of {healthy} healthy beyond four deviations");
        assert_eq!(beyond, 0, "{name}");
        assert!(times[times.len() - 1] <= known_s, "{name}: {times:?}");
    }
}
