//! A robot whose sensors publish payloads that are hard to record.

use bb_core::nalgebra::{Matrix3, Quaternion, Unit, Vector3};
use bb_core::prelude::*;
use bb_mcap::{Recorder, RecorderOptions};
use std::path::{Path, PathBuf};

/// Payload that only this robot has, not ROS.
#[derive(Clone, Debug, PartialEq, Payload)]
pub(crate) enum Gripper {
    /// Holds nothing.
    Open,
    /// Holds something.
    Holding { force_n: f32, what: String },
    /// State that it does not know.
    Unknown(Option<Vec<u16>>),
}

macro_rules! counted {
    ($(#[$doc:meta])* $sensor:ident, $payload:ty, $make:expr) => {
        $(#[$doc])*
        #[derive(Debug)]
        pub(crate) struct $sensor(u32);

        impl Sensor for $sensor {
            type Options = NoOptions;
            type Output = $payload;

            fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
                Ok(Self(0))
            }

            fn read(&mut self, _: MonotonicTime) -> Result<Reading<$payload>, Fault> {
                self.0 += 1;
                let make: fn(u32) -> $payload = $make;
                Ok(Reading::now(make(self.0)))
            }
        }
    };
}

counted! {
    /// Sometimes with covariances that ROS treats as unknown, and with a NaN that has a payload.
    Inertial, Imu, |n| Imu {
        orientation: (n.is_multiple_of(3)).then(|| Unit::new_unchecked(Quaternion::new(1.0, 0.0, -0.0, f64::from(n)))),
        orientation_covariance: (n.is_multiple_of(2)).then(Matrix3::identity),
        angular_velocity_covariance: (n.is_multiple_of(5)).then(Matrix3::zeros),
        ..Imu::new(
            Vector3::new(0.1 * f64::from(n), -0.0, 1e-300),
            Vector3::new(0.0, f64::MIN_POSITIVE, 9.81),
        )
    }
}

counted! {
    /// Half of them with a covariance.
    Compass, MagneticField, |n| MagneticField {
        magnetic_field: Vector3::new(2e-5, f64::from(n), 0.0),
        covariance: (n.is_multiple_of(2)).then(|| Matrix3::from_row_slice(&[1., 2., 3., 4., 5., 6., 7., 8., f64::from(n)])),
    }
}

counted! {
    /// Every variant.
    Grip, Gripper, |n| match n % 3 {
        0 => Gripper::Open,
        1 => Gripper::Holding { force_n: n as f32, what: format!("the cup {n}") },
        _ => Gripper::Unknown((n % 2 == 0).then(|| vec![1, 2, 3])),
    }
}

counted! {
    /// An encoder.
    Encoder, JointState, |n| JointState { position: f64::from(n), velocity: Some(0.5), effort: None }
}

counted! {
    /// Locator of the robot.
    Locator, Odometry, |n| Odometry {
        pose: Pose {
            position: Vector3::new(f64::from(n), 0.0, 0.0),
            world_from_body: Unit::new_unchecked(Quaternion::new(0.6, 0.0, 0.0, 0.8)),
            covariance: None,
        },
        twist: Twist { linear: Vector3::x(), angular: Vector3::zeros(), covariance: Some(bb_core::nalgebra::Matrix6::identity()) },
    }
}

robot! {
    /// One of each.
    pub(crate) robot Rover;

    link base {
        sensor imu: Inertial() { rate: 200 Hz; }
        sensor compass: Compass() { rate: 50 Hz; }
        sensor locator: Locator() { rate: 20 Hz; }
        joint mount: fixed {
            origin: { xyz: [0.2 m, 0 m, 0.9 m] };
            link mast;
        }
        joint arm: revolute {
            axis: z;
            origin: { xyz: [0 m, 0.5 m, 0 m] };
            limit: { lower: -1 rad, upper: 1 rad, velocity: 1 rad/s, effort: 1 N*m };
            sensor encoder: Encoder() { rate: 20 Hz; }
            link hand { sensor grip: Grip() { rate: 20 Hz; } }
        }
    }
}

/// A file that is removed when the test is over.
pub(crate) struct Temporary(PathBuf);

impl Temporary {
    pub(crate) fn new(name: &str) -> Self {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{name}.mcap", std::process::id()));
        let _ = std::fs::remove_file(&path);
        Self(path)
    }
}

impl std::ops::Deref for Temporary {
    type Target = Path;
    fn deref(&self) -> &Path {
        &self.0
    }
}

impl AsRef<Path> for Temporary {
    fn as_ref(&self) -> &Path {
        &self.0
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Records all of `millis` of virtual time.
pub(crate) fn record(path: &Path, millis: u64) {
    record_some(path, millis, Select::All, RecorderOptions::of::<Rover>());
}

/// Records some of `millis` of virtual time.
pub(crate) fn record_some(path: &Path, millis: u64, select: Select<'_>, options: RecorderOptions) {
    let builder = Rover::builder();
    let all = builder.subscribe_any(select, None, Overflow::default());
    let mut recorder = Recorder::new(path, all, options).expect("it can be created");
    let mut simulation = builder.simulate().expect("it starts");
    for _ in 0..millis / 10 {
        simulation.run_for(Duration::from_millis(10));
        recorder.drain().expect("there is room");
    }
    recorder.finish().expect("there is room");
}
