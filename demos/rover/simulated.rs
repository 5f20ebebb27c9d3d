//! A rover that rests, starts, and drives curves at changing speed for three minutes.

use crate::drive::{Drive, Event, fix};
use bb_core::nalgebra::{Matrix6, UnitQuaternion, Vector3};
use bb_core::payload::Twist;
use bb_core::prelude::*;
use bb_estimators::navigation::{Geodetic, LocalFrame};
use std::f64::consts::{FRAC_PI_2, PI};

const DURATION_S: u64 = 180;
const IMU: Vector3<f64> = Vector3::new(0.1, 0.0, 0.3);
const ANTENNA: Vector3<f64> = Vector3::new(-0.5, 0.2, 1.5);

/// Noise of one sample at 100 Hz, as the defaults of the filters have it, and biases.
const GYROSCOPE: f64 = 1.7e-3;
const ACCELEROMETER: f64 = 0.02;
const GYROSCOPE_BIAS: Vector3<f64> = Vector3::new(0.004, -0.003, 0.005);
const ACCELEROMETER_BIAS: Vector3<f64> = Vector3::new(0.03, -0.02, 0.04);

/// The wheels are larger than they are said to be, by this part.
const WHEEL_SCALE: f64 = 0.005;
const WHEELS: f64 = 0.05;
const FIX: f64 = 0.5;

/// State of the rover, m, rad, m/s.
#[derive(Clone, Copy, Debug)]
struct State {
    position: Vector3<f64>,
    heading: f64,
    speed: f64,
}

/// Returns the speed, m/s: at rest for three seconds, then between 1 and 2 m/s.
fn speed(time_s: f64) -> f64 {
    let start = ((time_s - 3.0) / 2.0).clamp(0.0, 1.0);
    start * (1.5 + 0.5 * (0.2 * (time_s - 3.0)).sin())
}

/// Curves to both sides, on and on away from where it started, rad/s.
fn yaw_rate(time_s: f64) -> f64 {
    let start = ((time_s - 5.0) / 2.0).clamp(0.0, 1.0);
    start * 0.15 * (0.3 * (time_s - 5.0)).sin()
}

impl State {
    fn world_from_base(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(0.0, 0.0, self.heading)
    }

    /// The velocity of a point of the rover, in the world.
    fn velocity(&self, time_s: f64, point: &Vector3<f64>) -> Vector3<f64> {
        let turning = Vector3::z() * yaw_rate(time_s);
        self.world_from_base() * (Vector3::x() * self.speed + turning.cross(point))
    }

    /// A millisecond later, by the midpoint.
    fn next(&self, time_s: f64) -> Self {
        const STEP_S: f64 = 1e-3;
        let middle = time_s + 0.5 * STEP_S;
        let heading = self.heading + 0.5 * STEP_S * yaw_rate(middle);
        let ahead = Vector3::new(heading.cos(), heading.sin(), 0.0);
        Self {
            position: self.position + ahead * (speed(middle) * STEP_S),
            heading: self.heading + STEP_S * yaw_rate(middle),
            speed: speed(time_s + STEP_S),
        }
    }
}

/// Numbers that are alike in every run: uniform, with a standard deviation of 1.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12_f64.sqrt()
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

pub(crate) fn drive() -> Drive {
    let frame = LocalFrame::new(Geodetic::from_degrees(48.1, 11.6, 520.0));
    let outage = 80.0..140.0;
    let board_from_base = UnitQuaternion::from_euler_angles(PI, 0.0, FRAC_PI_2).inverse();
    let mut drive = Drive { events: Vec::new(), truth: Vec::new(), frame, outage };
    let mut noise = Noise(7);
    let mut now = State { position: Vector3::zeros(), heading: 0.0, speed: 0.0 };
    let mut before = now;
    for millis in 0..DURATION_S * 1000 {
        let time_s = millis as f64 * 1e-3;
        let time = MonotonicTime::ZERO + Duration::from_millis(millis);
        if millis.is_multiple_of(100) {
            drive.truth.push((time, now.position));
        }
        if millis.is_multiple_of(50) {
            let linear = Vector3::x() * (now.speed * (1.0 + WHEEL_SCALE)) + WHEELS * noise.vector();
            let angular = Vector3::z() * (yaw_rate(time_s) + WHEELS * noise.next());
            let covariance = Some(Matrix6::from_diagonal_element(WHEELS * WHEELS));
            drive.events.push((time, Event::Wheels(Twist { linear, angular, covariance })));
        }
        if millis.is_multiple_of(200) && !drive.outage.contains(&time_s) {
            let antenna = now.position + now.world_from_base() * ANTENNA + FIX * noise.vector();
            drive.events.push((time, fix(&frame, &antenna, &Vector3::repeat(FIX))));
        }
        if millis.is_multiple_of(10) {
            // The means over the interval that ends now.
            let turning = Vector3::z() * ((now.heading - before.heading) * 100.0);
            let change = now.velocity(time_s, &IMU) - before.velocity(time_s - 0.01, &IMU);
            let middle = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.5 * (now.heading + before.heading));
            let force = middle.inverse() * (change * 100.0) + Vector3::new(0.0, 0.0, 9.80665);
            let rate = board_from_base * turning + GYROSCOPE_BIAS + GYROSCOPE * noise.vector();
            let force = board_from_base * force + ACCELEROMETER_BIAS + ACCELEROMETER * noise.vector();
            drive.events.push((time, Event::Imu(Imu::new(rate, force))));
            before = now;
        }
        now = now.next(time_s);
    }
    drive
}
