//! A drive or a flight: measurements and truth.

use bb_core::nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use bb_estimators::navigation::{AbsolutePose, Camera, Geodetic, GnssPosition, Observation, RelativePose, Start};
use std::collections::HashMap;
use std::path::PathBuf;

/// The range of standard deviations, in m, rad, m/s², rad/s: the square of a smaller one cannot be a divisor.
pub(crate) const DEVIATIONS: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// A drive or a flight: measurements, and the truth at keyframes. The world is ENU, the body frame is the IMU's.
#[derive(Clone, Debug)]
pub struct DataSet {
    /// The prefix of its files, or the bag.
    pub prefix: PathBuf,
    /// The samples of the IMU.
    pub samples: Vec<Sample>,
    /// Times of measurement or of truth, in order.
    pub keyframes: Vec<Keyframe>,
    /// Known state at the first keyframe.
    pub start: Start,
    /// The IMU's noise according to the data set; `None` if unknown.
    pub noise: Option<Noise>,
    /// The measurements at keyframes, by their number.
    pub relative: HashMap<u64, RelativePose>,
    /// Poses in the world.
    pub anchors: HashMap<u64, AbsolutePose>,
    /// Positions of satellite navigation.
    pub fixes: HashMap<u64, GnssPosition>,
    /// The camera that sees landmarks, if there are any.
    pub camera: Option<Camera>,
    /// The landmarks seen at each keyframe; used only by smoothers.
    pub seen: HashMap<u64, Vec<Observation>>,
}

/// Means over `dt` seconds: rad/s, m/s².
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// rad/s.
    pub angular_velocity: Vector3<f64>,
    /// m/s².
    pub specific_force: Vector3<f64>,
    /// Duration, s.
    pub dt: f64,
}

/// A time with a measurement other than the IMU's, or with truth.
#[derive(Clone, Copy, Debug)]
pub struct Keyframe {
    /// s.
    pub time_s: f64,
    /// Index of the first sample after it.
    pub sample: usize,
    /// True if the truth is to be scored there.
    pub scored: bool,
    /// The truth, if it is known.
    pub truth: Option<Truth>,
}

/// The truth at a time.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    /// Position in the world, m.
    pub position: Vector3<f64>,
    /// Unknown on some drives.
    pub world_from_body: Option<UnitQuaternion<f64>>,
    /// Velocity in the world, m/s.
    pub velocity: Option<Vector3<f64>>,
}

impl Truth {
    /// The truth in another world.
    pub(crate) fn moved(&self, new_from_old: &Isometry3<f64>) -> Self {
        let turn = new_from_old.rotation;
        Self {
            position: new_from_old * Point3::from(self.position) - Point3::origin(),
            world_from_body: self.world_from_body.map(|truth| turn * truth),
            velocity: self.velocity.map(|velocity| turn * velocity),
        }
    }
}

/// Densities of a data sheet, and gravity.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// rad/s/√Hz.
    pub gyroscope: f64,
    /// Random walk of the gyroscope's bias, rad/s²/√Hz.
    pub gyroscope_bias: f64,
    /// m/s²/√Hz.
    pub accelerometer: f64,
    /// Random walk of the accelerometer's bias, m/s³/√Hz.
    pub accelerometer_bias: f64,
    /// m/s².
    pub gravity: f64,
}

/// The contents of a message of the truth.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TruthMessage {
    Pose(Isometry3<f64>),
    /// A pose, and linear and angular velocity in its axes.
    Moving(Isometry3<f64>, [Vector3<f64>; 2]),
    /// Latitude, longitude and height, if there is a position.
    OnEarth(Option<Geodetic>),
    /// All that is known.
    State(Truth),
}

impl DataSet {
    /// The number of keyframes.
    pub fn count(&self) -> usize {
        self.keyframes.len()
    }
}

pub(crate) fn nanoseconds(seconds: f64) -> i64 {
    // A cast saturates.
    (seconds * 1e9).round() as i64
}
