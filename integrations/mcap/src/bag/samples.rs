//! The samples of a recorded IMU, each with the reading of the magnetometer that belongs to it.

use super::{Bag, BagMessage, BagMessages};
use crate::RecordingError;
use bb_core::prelude::*;

/// The type of an IMU's topic.
pub const IMU: &str = "sensor_msgs/msg/Imu";
/// The type of a magnetometer's topic.
pub const MAGNETIC_FIELD: &str = "sensor_msgs/msg/MagneticField";

/// The samples of a recorded IMU at the stamps of their headers, in the order of the file.
///
/// A reading of the magnetometer belongs to the IMU sample with the same stamp, if that comes just before or after it
/// in the file; otherwise to the sample before it. Bags contain messages of one instant in any order, so each sample
/// waits for the next one. Samples may be out of order; estimators refuse those.
///
/// An error comes after the last sample before it, and ends the iteration.
#[derive(Debug)]
pub struct MargSamples {
    messages: BagMessages,
    /// The sample that is held until its magnetometer reading is known.
    pending: Option<(MonotonicTime, Marg)>,
    /// The last reading, if it may belong to the next sample.
    early: Option<(MonotonicTime, MagneticField)>,
    /// The error to be returned after that sample.
    broken: Option<RecordingError>,
    /// `true` after an error.
    is_over: bool,
}

impl MargSamples {
    /// Reads the topic of an IMU and, if one is named, that of a magnetometer, up to the first sample.
    ///
    /// # Errors
    /// The bag has no such topics, or is broken before the first sample.
    pub fn read(bag: &Bag, imu_topic: &str, magnetometer_topic: Option<&str>) -> Result<Self, RecordingError> {
        let topics: Vec<_> = [imu_topic].into_iter().chain(magnetometer_topic).collect();
        let mut samples =
            Self { messages: bag.messages(&topics)?, pending: None, early: None, broken: None, is_over: false };
        samples.advance()?;
        Ok(samples)
    }

    /// Returns the time of the next sample's measurement; `None` at the end.
    pub fn next_time(&self) -> Option<MonotonicTime> {
        self.pending.as_ref().map(|(time, _)| *time)
    }

    /// Reads up to the next message of the IMU, and returns the held sample.
    fn advance(&mut self) -> Result<Option<(MonotonicTime, Marg)>, RecordingError> {
        while let Some(message) = self.messages.next() {
            let message = message.inspect_err(|_| self.settle())?;
            if *message.schema == *IMU {
                let (time, imu) = read::<Imu>(&message)?;
                let magnetic_field = match self.early.take() {
                    Some((measured, field)) if measured == time => Some(field),
                    Some((_, field)) => {
                        self.give(field);
                        None
                    }
                    None => None,
                };
                return Ok(self.pending.replace((time, Marg { imu, magnetic_field })));
            }
            let (measured, field) = read::<MagneticField>(&message)?;
            match &self.pending {
                Some((time, _)) if *time == measured => self.give(field),
                _ => {
                    if let Some((_, before)) = self.early.replace((measured, field)) {
                        self.give(before);
                    }
                }
            }
        }
        self.settle();
        Ok(self.pending.take())
    }

    /// Gives the last reading to the held sample: at the end, there is no further sample that it may belong to.
    fn settle(&mut self) {
        if let Some((_, field)) = self.early.take() {
            self.give(field);
        }
    }

    /// A reading for the held sample, if there is one.
    fn give(&mut self, field: MagneticField) {
        if let Some((_, sample)) = &mut self.pending {
            sample.magnetic_field = Some(field);
        }
    }
}

impl Iterator for MargSamples {
    type Item = Result<(MonotonicTime, Marg), RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(error) = self.broken.take() {
            return Some(Err(error));
        }
        if self.is_over {
            return None;
        }
        match self.advance() {
            Ok(sample) => sample.map(Ok),
            Err(error) => {
                self.is_over = true;
                let Some(sample) = self.pending.take() else { return Some(Err(error)) };
                self.broken = Some(error);
                Some(Ok(sample))
            }
        }
    }
}

/// A payload, at the stamp of its header.
fn read<T: Payload>(message: &BagMessage) -> Result<(MonotonicTime, T), RecordingError> {
    let (payload, time) = message.payload()?;
    Ok((MonotonicTime::from_nanos(time.as_unix_nanos()), payload))
}
