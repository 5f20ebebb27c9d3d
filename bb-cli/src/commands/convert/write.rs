//! Entries as the messages of a bag.

use super::entry::{Entry, FIX, What};
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
const GNSS: Frame = Frame::new("gnss");

const NAMED: [&str; 5] = ["/imu", "/mag", FIX, "/truth", "/moving"];

/// A bag being written.
pub(super) struct Bag {
    writer: BagWriter,
    counts: Counts,
    /// State of motion written last.
    moving: Option<bool>,
}

/// The number of messages on each topic, in the order of their first.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts(Vec<(String, u64)>);

impl Bag {
    pub(super) fn create(file: &Path) -> Result<Self, String> {
        let mut options = RecorderOptions::default();
        options.compression = Compression::Zstd;
        let writer = BagWriter::create(file, &options).map_err(|error| error.to_string())?;
        Ok(Self { writer, counts: Counts::default(), moving: None })
    }

    pub(super) fn entry(&mut self, Entry { time_ns, what }: Entry) -> Result<(), String> {
        match what {
            What::Moving(data) => {
                if self.moving.replace(data) == Some(data) {
                    return Ok(());
                }
                let time = WallTime::from_unix_nanos(time_ns);
                self.writer.message("/moving", time, &Bool { data }).map_err(|error| error.to_string())?;
                self.counts.add("/moving");
                Ok(())
            }
            What::Imu { angular_velocity, specific_force } => {
                let imu = Imu::new(Vector3::from(angular_velocity), Vector3::from(specific_force));
                self.write("/imu", time_ns, IMU, imu)
            }
            // Joined before.
            What::AngularVelocity(_) | What::SpecificForce(_) => Ok(()),
            What::MagneticField(field) => {
                self.write("/mag", time_ns, IMU, MagneticField::new(Vector3::from(field)))
            }
            What::Truth { orientation: [w, x, y, z], position } => {
                let pose = Pose {
                    position: Vector3::from(position),
                    world_from_body: UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
                    covariance: None,
                };
                self.write("/truth", time_ns, IMU, pose)
            }
            What::Fix { topic, fix } => self.write(&topic, time_ns, GNSS, fix),
            What::Encoded { topic, schema, data } => {
                let time = WallTime::from_unix_nanos(time_ns);
                self.writer.encoded(&topic, &schema, time, &data).map_err(|error| error.to_string())?;
                self.counts.add(&topic);
                Ok(())
            }
        }
    }

    fn write<T: Payload>(&mut self, topic: &str, time_ns: i64, frame: Frame, payload: T) -> Result<(), String> {
        let mut message = Stamped::new(MonotonicTime::from_nanos(time_ns), payload);
        message.wall_time = WallTime::from_unix_nanos(time_ns);
        message.frame = frame;
        self.writer.payload(topic, &message).map_err(|error| error.to_string())?;
        self.counts.add(topic);
        Ok(())
    }

    pub(super) fn finish(self) -> Result<Counts, String> {
        self.writer.finish().map_err(|error| error.to_string())?;
        Ok(self.counts)
    }
}

impl Counts {
    fn add(&mut self, topic: &str) {
        match self.0.iter_mut().find(|(known, _)| known == topic) {
            Some((_, count)) => *count += 1,
            None => self.0.push((topic.to_owned(), 1)),
        }
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // What `bb` gives names to comes first.
        let rank = |topic: &str| NAMED.iter().position(|named| *named == topic).unwrap_or(NAMED.len());
        let mut counts = self.0.clone();
        counts.sort_by_key(|(topic, _)| rank(topic));
        let counts: Vec<_> = counts.iter().map(|(topic, count)| format!("{count} on {topic}")).collect();
        f.write_str(&counts.join(", "))
    }
}
