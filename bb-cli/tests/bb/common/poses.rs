//! A simulated IMU of known errors in many poses.

use super::bags;
use super::noise::Noise;
use bags::ros::*;
use bb_core::nalgebra::{Matrix3, UnitQuaternion, Vector3 as V};
use std::path::PathBuf;

pub const GRAVITY: f64 = 9.81;
const PERIOD_NS: u64 = 10_000_000;

/// Errors of the simulated sensors.
pub struct Errors {
    pub gyroscope: V<f64>,
    pub accelerometer: (V<f64>, Matrix3<f64>),
    pub magnetometer: (V<f64>, Matrix3<f64>),
}

pub fn errors() -> Errors {
    Errors {
        gyroscope: V::new(0.02, -0.01, 0.005),
        accelerometer: (V::new(0.3, -0.2, 0.1), Matrix3::new(1.02, 0.01, -0.02, 0.0, 0.98, 0.015, 0.0, 0.0, 1.01)),
        magnetometer: (V::new(2e-5, -4e-5, 1e-5), Matrix3::new(1.05, 0.02, 0.0, 0.02, 0.97, 0.01, 0.0, 0.01, 1.0)),
    }
}

/// One sample as the sensors read it: angular velocity, specific force, field.
pub type Read = [V<f64>; 3];

/// Three seconds in each of 24 orientations, with a turn of a second between; noise that is the same each time.
pub fn samples(errors: &Errors) -> Vec<Read> {
    let orientation = |index: usize| {
        // All faces of a cube to the ground, each turned and leaning a little.
        let axes = [V::z(), -V::z(), V::x(), -V::x(), V::y(), -V::y()];
        let face = UnitQuaternion::rotation_between(&axes[index % 6], &V::z());
        let face = face.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&V::x_axis(), std::f64::consts::PI));
        let lean = 0.25 * (index / 6) as f64;
        UnitQuaternion::from_euler_angles(lean, -lean, index as f64) * face
    };
    let inverse = |(offset, matrix): &(V<f64>, Matrix3<f64>), truth: V<f64>| {
        matrix.try_inverse().expect("near 1") * truth + offset
    };
    let mut noise = Noise::new(1);
    let mut samples = Vec::new();
    for pose in 0..24 {
        let (from, to) = (orientation(pose), orientation(pose + 1));
        for i in 0..400 {
            let part = (f64::from(i) - 300.0).max(0.0) / 100.0;
            let world_from_body = from.slerp(&to, part);
            let rate = if i < 300 { V::zeros() } else { (from.inverse() * to).scaled_axis() };
            let force = world_from_body.inverse() * V::new(0.0, 0.0, GRAVITY);
            let shaken = if i < 300 { 0.02 } else { 1.0 };
            let field = world_from_body.inverse() * V::new(0.0, 20e-6, -44e-6);
            samples.push([
                rate + errors.gyroscope + noise.vector(0.002),
                inverse(&errors.accelerometer, force + noise.vector(shaken)),
                inverse(&errors.magnetometer, field + noise.vector(2e-7)),
            ]);
        }
    }
    samples
}

pub fn bag(samples: &[Read], name: &str, magnetometer: bool) -> PathBuf {
    let mut maker = bags::Maker::new(mcap::WriteOptions::new());
    let imu_topic = maker.topic("/imu", "sensor_msgs/msg/Imu");
    let mag_topic = magnetometer.then(|| maker.topic("/mag", "sensor_msgs/msg/MagneticField"));
    let vector = |v: &V<f64>| Vector3 { x: v.x, y: v.y, z: v.z };
    for (index, [rate, force, field]) in samples.iter().enumerate() {
        let time = PERIOD_NS * (index as u64 + 1);
        let stamp = Stamp { sec: (time / 1_000_000_000) as i32, nanosec: (time % 1_000_000_000) as u32 };
        let header = Header { stamp, frame_id: "imu".into() };
        let imu = Imu {
            header: header.clone(),
            angular_velocity: vector(rate),
            linear_acceleration: vector(force),
            ..Imu::default()
        };
        maker.bytes_at(imu_topic, time, &bags::little(&imu));
        if let Some(topic) = mag_topic {
            let field = MagneticField { header, magnetic_field: vector(field), ..MagneticField::default() };
            maker.bytes_at(topic, time, &bags::little(&field));
        }
    }
    bags::file(name, &maker.finish())
}
