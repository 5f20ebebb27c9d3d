//! A gate that gives way to fixes that agree with each other.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::started;
use crate::navigation::state::Navigation;
use crate::navigation::{BodyVelocity, Eskf, GnssPosition, ImuMean, Stream};

/// Fixes of a robot that drives on while a filter at rest, which knows its velocity well, is wrong.
struct Drive {
    filter: Eskf<Navigation, 15>,
    stream: Stream,
    time_s: i64,
    velocity: Vector3<f64>,
    deviation: f64,
    refused: u32,
}

impl Drive {
    /// The filter has followed a robot at rest for a minute, by fixes of `deviation`.
    fn new(velocity: Vector3<f64>, deviation: f64) -> Self {
        let filter = started();
        let mut drive = Self {
            filter,
            stream: Stream::default(),
            time_s: 0,
            velocity: Vector3::zeros(),
            deviation,
            refused: 0,
        };
        (0..60).for_each(|_| drive.second(Vector3::zeros()));
        assert_eq!(drive.refused, 0);
        drive.velocity = velocity;
        drive
    }

    fn second(&mut self, position: Vector3<f64>) {
        for i in 1..=100 {
            let gravity = self.filter.params().gravity;
            let sample = ImuMean {
                time_ns: self.time_s * 1_000_000_000 + i * 10_000_000,
                angular_velocity: Vector3::zeros(),
                specific_force: Vector3::new(0.0, 0.0, gravity),
            };
            self.filter.propagate(&sample).unwrap();
        }
        self.time_s += 1;
        let fix = GnssPosition::new(position, self.deviation, self.deviation);
        self.refused += u32::from(self.filter.update(&mut self.stream, &fix).is_err());
    }

    /// Drives on for some seconds, and returns the errors of position and velocity.
    fn drive(&mut self, seconds: i64) -> (f64, f64) {
        let from_s = self.time_s;
        let mut position = Vector3::zeros();
        while self.time_s < from_s + seconds {
            position = self.velocity * (self.time_s + 1 - from_s) as f64;
            self.second(position);
        }
        let estimate = self.filter.estimate().unwrap();
        ((estimate.position - position).norm(), (estimate.velocity - self.velocity).norm())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// A velocity that is wrong, and not the position, is corrected too, by a little as by much.
    #[test]
    fn a_wrong_velocity_is_found(
        speed in 2.0..40.0_f64,
        course in 0.0..std::f64::consts::TAU,
        deviation in 0.05..2.0_f64,
    ) {
        let mut drive = Drive::new(Vector3::new(speed * course.cos(), speed * course.sin(), 0.0), deviation);
        let (position, velocity) = drive.drive(20);
        prop_assert!(drive.filter.is_consistent());
        prop_assert!(position < 5.0 * deviation && velocity < 5.0 * deviation, "{position} m, {velocity} m/s");
        prop_assert!(drive.refused <= 6, "{}", drive.refused);
    }

    /// Wrong fixes that agree may move the filter, wherever to. Right ones bring it back, with its velocity, and what it knew of
    /// its attitude is not lost.
    #[test]
    fn right_fixes_bring_it_back(
        distance in prop_oneof![3.0..100.0_f64, 100.0..1e6_f64],
        course in 0.0..std::f64::consts::TAU,
        wrong in 1..16_usize,
        deviation in 0.05..2.0_f64,
        seed in prop::array::uniform16(-1.0..1.0_f64),
    ) {
        let mut drive = Drive::new(Vector3::zeros(), deviation);
        let attitude = drive.filter.covariance().fixed_view::<3, 3>(6, 6).trace();
        let there = Vector3::new(distance * course.cos(), distance * course.sin(), 0.0);
        for error in seed.iter().take(wrong) {
            drive.second(there + Vector3::new(deviation * error, 0.0, 0.0));
        }
        prop_assert!(drive.filter.is_consistent());
        let (position, velocity) = drive.drive(30);
        prop_assert!(drive.filter.is_consistent());
        prop_assert!(position < 5.0 * deviation && velocity < 2.0 * deviation, "{position} m, {velocity} m/s");
        let after = drive.filter.covariance().fixed_view::<3, 3>(6, 6).trace();
        prop_assert!(after < 10.0 * attitude, "{attitude} rad² before, {after} after");
    }
}

/// Neither when they begin nor when they end are they taken for a motion.
#[test]
fn far_outliers_do_not_change_the_velocity() {
    for wrong in 4..12 {
        let mut drive = Drive::new(Vector3::zeros(), 1.0);
        for second in 0..wrong + 20 {
            let is_wrong = second < wrong;
            drive.second(if is_wrong { Vector3::new(1e3, -700.0, 0.0) } else { Vector3::zeros() });
            let velocity = drive.filter.estimate().unwrap().velocity.norm();
            assert!(velocity < 0.5, "{wrong} outliers, {second} s: {velocity} m/s");
        }
        assert!(drive.filter.estimate().unwrap().position.norm() < 2.0, "{wrong}");
    }
}

/// Wheels that slip say nothing of the position: it is no less certain for them, however often they give way.
#[test]
fn a_velocity_that_does_not_fit_leaves_the_position() {
    let mut drive = Drive::new(Vector3::zeros(), 1.0);
    let mut wheels = Stream::default();
    let before = drive.filter.covariance()[(0, 0)];
    for slip in [0.5, 5.0, 0.0, 5.0, 0.5, 0.0] {
        for _ in 0..7 {
            let speed = BodyVelocity {
                velocity: Vector3::new(slip, 0.0, 0.0),
                deviation: 0.05,
                body_from_sensor: UnitQuaternion::identity(),
                lever_arm: Vector3::zeros(),
            };
            let _ = drive.filter.update(&mut wheels, &speed);
        }
    }
    assert!(wheels.counts().recoveries > 2, "{:?}", wheels.counts());
    assert!(drive.filter.covariance()[(0, 0)] <= before * (1.0 + 1e-9));
}

/// The misfit of a drift is not taken for a jump: the first fix that the gate lets pass corrects the velocity as well.
#[test]
fn a_velocity_that_is_slightly_wrong_costs_no_more_than_the_patience() {
    let mut drive = Drive::new(Vector3::new(3.0, 0.0, 0.0), 1.0);
    let (position, velocity) = drive.drive(10);
    assert!(drive.refused <= 3, "{}", drive.refused);
    assert!(position < 1.0 && velocity < 1.0, "{position} m, {velocity} m/s");
}
