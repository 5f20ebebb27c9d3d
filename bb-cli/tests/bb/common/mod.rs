//! Runs the command, on small recordings made here.

// The tests of bb-mcap use the rest of it.
#![allow(dead_code, unreachable_pub)]

#[path = "../../../../integrations/mcap/tests/bags/common.rs"]
pub mod bags;
pub mod noise;
pub mod poses;

use bags::ros::*;
use bb_core::nalgebra::{UnitQuaternion, Vector3 as V};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Result of the command.
pub struct Output {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

pub fn bb(arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_bb")).args(arguments).output().expect("runs");
    let text = |bytes| String::from_utf8(bytes).expect("is text");
    Output { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

pub fn eval(files: &[&Path], arguments: &[&str]) -> Output {
    let files = files.iter().map(|file| file.to_str().expect("is text"));
    bb(&["eval", "attitude"].into_iter().chain(files).chain(arguments.iter().copied()).collect::<Vec<_>>())
}

/// A recording to make: 100 Hz, rest for a second, then a turn about the vertical by 0.5 rad/s.
pub struct Walk {
    pub samples: u32,
    pub magnetometer: bool,
    pub truth: bool,
    pub moving: bool,
    /// Names of topics, IMU, magnetometer, truth, moving.
    pub names: [&'static str; 4],
    /// A second topic of each type, with nothing in it.
    pub twice: bool,
    /// Truth without a number in these samples.
    pub lost: std::ops::Range<u32>,
    /// Added to the true heading, rad: the error that the filters have.
    pub error: f64,
    /// The gyroscope's, rad/s.
    pub bias: f64,
    /// Axis of the turn.
    pub axis: V<f64>,
    /// Units of the gyroscope, the accelerometer and the magnetometer, as parts of the SI unit.
    pub units: [f64; 3],
    /// Convention in which the truth is written, applied to `world_from_body`.
    pub written: fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>,
    /// The magnetometer's topic is there, and nothing on it.
    pub silent: bool,
}

impl Default for Walk {
    fn default() -> Self {
        let names = ["/imu", "/mag", "/truth", "/moving"];
        let (magnetometer, truth, moving) = (true, true, true);
        Self {
            samples: 300,
            magnetometer,
            truth,
            moving,
            names,
            twice: false,
            lost: 0..0,
            error: 0.0,
            bias: 0.0,
            axis: V::z(),
            units: [1.0; 3],
            written: |truth| truth,
            silent: false,
        }
    }
}

const START_NS: u64 = 20_000_000_000;
const PERIOD_NS: u64 = 10_000_000;
const RATE: f64 = 0.5;
const REST: u32 = 100;

impl Walk {
    pub fn bytes(&self) -> Vec<u8> {
        let mut maker = bags::Maker::new(mcap::WriteOptions::new().chunk_size(Some(4000)));
        let types = [
            ("sensor_msgs/msg/Imu", true),
            ("sensor_msgs/msg/MagneticField", self.magnetometer),
            ("geometry_msgs/msg/PoseStamped", self.truth),
            ("std_msgs/msg/Bool", self.moving),
        ];
        let mut topics = [0; 4];
        for (topic, ((schema, there), name)) in topics.iter_mut().zip(types.iter().zip(self.names)) {
            if *there {
                *topic = maker.topic(name, schema);
            }
            if self.twice {
                maker.topic(&format!("{name}_too"), schema);
            }
        }
        for i in 0..self.samples {
            let time = START_NS + PERIOD_NS * u64::from(i);
            let turning = i > REST;
            let angle = f64::from(i.saturating_sub(REST)) * RATE * 0.01;
            let rotation = UnitQuaternion::from_scaled_axis(self.axis * angle);
            let header = Header { stamp: stamp(time), frame_id: "imu".into() };
            if self.moving && (i == 0 || i == REST + 1) {
                maker.bytes_at(topics[3], time, &bags::little(&Bool { data: turning }));
            }
            let vector = |v: V<f64>, unit: f64| Vector3 { x: v.x * unit, y: v.y * unit, z: v.z * unit };
            let rate = V::z() * self.bias + self.axis * if turning { RATE } else { 0.0 };
            let force = rotation.inverse() * V::new(0.0, 0.0, 9.81);
            let imu = Imu {
                header: header.clone(),
                angular_velocity: vector(rate, self.units[0]),
                linear_acceleration: vector(force, self.units[1]),
                ..Imu::default()
            };
            maker.bytes_at(topics[0], time, &bags::little(&imu));
            if self.magnetometer && !self.silent {
                let field = rotation.inverse() * V::new(0.0, 2e-5, -4e-5);
                let magnetic_field = vector(field, self.units[2]);
                let field = MagneticField { header: header.clone(), magnetic_field, ..MagneticField::default() };
                maker.bytes_at(topics[1], time, &bags::little(&field));
            }
            if self.truth {
                let turned = (self.written)(UnitQuaternion::from_axis_angle(&V::z_axis(), self.error) * rotation);
                let mut orientation = Quaternion { x: turned.i, y: turned.j, z: turned.k, w: turned.w };
                if self.lost.contains(&i) {
                    orientation = Quaternion { x: f64::NAN, y: f64::NAN, z: f64::NAN, w: f64::NAN };
                }
                let pose = Pose { orientation, ..Pose::default() };
                maker.bytes_at(topics[2], time, &bags::little(&PoseStamped { header, pose }));
            }
        }
        maker.finish()
    }

    /// A file of this name in the directory that cargo keeps for tests.
    pub fn file(&self, name: &str) -> PathBuf {
        bags::file(name, &self.bytes())
    }
}

pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    bags::file(name, bytes)
}

fn stamp(time_ns: u64) -> Stamp {
    Stamp { sec: (time_ns / 1_000_000_000) as i32, nanosec: (time_ns % 1_000_000_000) as u32 }
}
