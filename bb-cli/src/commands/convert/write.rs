//! Rows as the messages of a bag.

use super::cells::Row;
use bb_core::message::Frame;
use bb_core::nalgebra::{Quaternion, UnitQuaternion, Vector3};
use bb_core::payload::{Imu, MagneticField, Pose};
use bb_core::time::MonotonicTime;
use bb_core::{Payload, Stamped, WallTime};
use bb_mcap::{BagWriter, Bool, Compression, RecorderOptions};
use std::fmt;
use std::path::Path;

/// The frame of the measurements, and that of the truth.
const IMU: Frame = Frame::new("imu");

/// A bag being written.
pub(super) struct Bag {
    writer: BagWriter,
    counts: Counts,
    /// What was written last.
    moving: Option<bool>,
}

/// The number of messages of each kind.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counts {
    imu: u64,
    mag: u64,
    truth: u64,
    moving: u64,
}

impl Bag {
    pub(super) fn create(file: &Path) -> Result<Self, String> {
        let mut options = RecorderOptions::default();
        options.compression = Compression::Zstd;
        let writer = BagWriter::create(file, &options).map_err(|error| error.to_string())?;
        Ok(Self { writer, counts: Counts::default(), moving: None })
    }

    pub(super) fn row(&mut self, row: &Row) -> Result<(), String> {
        let time_ns = row.time_ns;
        if let Some(data) = row.moving.filter(|moving| Some(*moving) != self.moving) {
            self.moving = Some(data);
            let time = WallTime::from_unix_nanos(time_ns);
            self.writer.message("/moving", time, &Bool { data }).map_err(|error| error.to_string())?;
            self.counts.moving += 1;
        }
        if let (Some(rate), Some(force)) = (row.angular_velocity, row.specific_force) {
            let imu = Imu::new(Vector3::from(rate), Vector3::from(force));
            self.write("/imu", time_ns, imu)?;
            self.counts.imu += 1;
        }
        if let Some(field) = row.magnetic_field {
            let field = MagneticField::new(Vector3::from(field));
            self.write("/mag", time_ns, field)?;
            self.counts.mag += 1;
        }
        if row.orientation.is_some() || row.position.is_some() {
            let [w, x, y, z] = row.orientation.unwrap_or([f64::NAN; 4]);
            let pose = Pose {
                position: Vector3::from(row.position.unwrap_or([f64::NAN; 3])),
                world_from_body: UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
                covariance: None,
            };
            self.write("/truth", time_ns, pose)?;
            self.counts.truth += 1;
        }
        Ok(())
    }

    fn write<T: Payload>(&mut self, topic: &str, time_ns: i64, payload: T) -> Result<(), String> {
        let mut message = Stamped::new(MonotonicTime::from_nanos(time_ns), payload);
        message.wall_time = WallTime::from_unix_nanos(time_ns);
        message.frame = IMU;
        self.writer.payload(topic, &message).map_err(|error| error.to_string())
    }

    pub(super) fn finish(self) -> Result<Counts, String> {
        self.writer.finish().map_err(|error| error.to_string())?;
        Ok(self.counts)
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [("/imu", self.imu), ("/mag", self.mag), ("/truth", self.truth), ("/moving", self.moving)];
        let counts =
            counts.iter().filter(|(_, count)| *count > 0).map(|(topic, count)| format!("{count} on {topic}"));
        f.write_str(&counts.collect::<Vec<_>>().join(", "))
    }
}
