//! A drive or a flight: measurements and truth.

use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_estimators::navigation::{
    AbsolutePose, BodyVelocity, Camera, GnssPosition, Observation, RelativePose, Start,
};
use std::collections::HashMap;
use std::path::PathBuf;

/// The range of standard deviations, in m, rad, m/s², rad/s: the square of a smaller one cannot be a divisor.
pub(crate) const DEVIATIONS: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// A drive or a flight: measurements, and the truth at keyframes. The world is ENU, the body frame is the IMU's.
#[derive(Clone, Debug)]
pub struct DataSet {
    /// The prefix of its files, or the bag.
    pub prefix: PathBuf,
    pub(crate) samples: Vec<Sample>,
    pub(crate) keyframes: Vec<Keyframe>,
    /// What is known of the first keyframe.
    pub(crate) start: Start,
    /// The IMU's noise according to the data set; `None` if unknown.
    pub(crate) noise: Option<Noise>,
    /// The measurements at keyframes, by their number.
    pub(crate) relative: HashMap<u64, RelativePose>,
    pub(crate) anchors: HashMap<u64, AbsolutePose>,
    pub(crate) fixes: HashMap<u64, GnssPosition>,
    pub(crate) velocities: HashMap<u64, BodyVelocity>,
    /// The camera that sees landmarks, if there are any.
    pub(crate) camera: Option<Camera>,
    /// The landmarks seen at each keyframe; used only by smoothers.
    pub(crate) seen: HashMap<u64, Vec<Observation>>,
    /// Whether filters also use fixes when there are relative poses; smoothers always do.
    pub(crate) fixes_beside_relative: bool,
    /// The point of the body whose position the truth without an orientation tells, m.
    pub(crate) antenna: Vector3<f64>,
}

/// Means over `dt` seconds: rad/s, m/s².
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) angular_velocity: Vector3<f64>,
    pub(crate) specific_force: Vector3<f64>,
    pub(crate) dt: f64,
}

/// A time with a measurement other than the IMU's, or with truth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Keyframe {
    pub(crate) time_s: f64,
    /// The first sample after it.
    pub(crate) sample: usize,
    pub(crate) scored: bool,
    /// By a relative pose.
    pub(crate) is_referred_to: bool,
    pub(crate) truth: Option<Truth>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Truth {
    pub(crate) position: Vector3<f64>,
    /// Unknown on some drives.
    pub(crate) world_from_body: Option<UnitQuaternion<f64>>,
    pub(crate) velocity: Option<Vector3<f64>>,
}

/// Densities of a data sheet, and gravity.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    pub(crate) gyroscope: f64,
    pub(crate) gyroscope_bias: f64,
    pub(crate) accelerometer: f64,
    pub(crate) accelerometer_bias: f64,
    pub(crate) gravity: f64,
}

impl DataSet {
    /// The number of keyframes.
    pub fn count(&self) -> usize {
        self.keyframes.len()
    }

    /// Records the keyframes that relative poses refer to.
    pub(crate) fn referred(mut self) -> Self {
        for relative in self.relative.values() {
            let keyframe = usize::try_from(relative.keyframe).ok();
            if let Some(keyframe) = keyframe.and_then(|index| self.keyframes.get_mut(index)) {
                keyframe.is_referred_to = true;
            }
        }
        self
    }
}

pub(crate) fn nanoseconds(seconds: f64) -> i64 {
    // A cast saturates.
    (seconds * 1e9).round() as i64
}
