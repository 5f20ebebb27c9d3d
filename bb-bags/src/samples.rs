//! The samples of a recorded IMU, each with the reading of the magnetometer that belongs to it.

use crate::{Bag, BagError, Messages, RosMessage, ros};
use bb_core::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use bb_core::prelude::*;

/// The samples of a recorded IMU at the stamps of their headers, in the order of the file.
///
/// A reading of the magnetometer goes with the IMU's sample before which, or with which, it was recorded: bags hold
/// messages of one instant in any order, so a sample waits for the next one. Samples may be out of order; it is for
/// whoever takes them to refuse those.
///
/// An error comes after the last sample before it, and is the end.
#[derive(Debug)]
pub struct MargSamples {
    messages: Messages,
    /// The sample that waits until it is known which reading of the magnetometer belongs to it.
    pending: Option<(MonotonicTime, Marg)>,
    /// The error that waits for that sample to be taken.
    broken: Option<BagError>,
}

impl MargSamples {
    /// Reads the topic of an IMU and, if one is named, that of a magnetometer, up to the first sample.
    ///
    /// # Errors
    /// The bag has no such topics, or is broken before the first sample.
    pub fn read(bag: &Bag, imu_topic: &str, magnetometer_topic: Option<&str>) -> Result<Self, BagError> {
        let topics: Vec<_> = [imu_topic].into_iter().chain(magnetometer_topic).collect();
        let mut samples = Self { messages: bag.messages(&topics)?, pending: None, broken: None };
        samples.advance()?;
        Ok(samples)
    }

    /// When the sample that comes next was measured; none at the end.
    pub fn next_time(&self) -> Option<MonotonicTime> {
        self.pending.as_ref().map(|(time, _)| *time)
    }

    /// Reads up to the next message of the IMU, and gives the sample that waited for it.
    fn advance(&mut self) -> Result<Option<(MonotonicTime, Marg)>, BagError> {
        for message in self.messages.by_ref() {
            match message?.payload {
                RosMessage::Imu(imu) => {
                    let next = Marg { imu: imu_of(&imu), magnetic_field: None };
                    return Ok(self.pending.replace((time_of(imu.header.stamp), next)));
                }
                RosMessage::MagneticField(field) => {
                    if let Some((_, sample)) = &mut self.pending {
                        sample.magnetic_field = Some(MagneticField {
                            magnetic_field: vector_of(&field.magnetic_field),
                            covariance: covariance_of(&field.magnetic_field_covariance),
                        });
                    }
                }
                _ => {}
            }
        }
        Ok(self.pending.take())
    }
}

impl Iterator for MargSamples {
    type Item = Result<(MonotonicTime, Marg), BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        if let Some(error) = self.broken.take() {
            return Some(Err(error));
        }
        match self.advance() {
            Ok(sample) => sample.map(Ok),
            Err(error) => match self.pending.take() {
                Some(sample) => {
                    self.broken = Some(error);
                    Some(Ok(sample))
                }
                None => Some(Err(error)),
            },
        }
    }
}

fn time_of(stamp: ros::Stamp) -> MonotonicTime {
    MonotonicTime::from_nanos(stamp.nanoseconds())
}

fn vector_of(vector: &ros::Vector3) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}

/// ROS marks what is unknown: covariances by zeros, an orientation by -1 as its covariance's first element.
fn imu_of(imu: &ros::Imu) -> Imu {
    let has_orientation = imu.orientation_covariance[0] >= 0.0;
    let ros::Quaternion { x, y, z, w } = imu.orientation;
    let quaternion = Quaternion::new(w, x, y, z);
    let is_rotation = has_orientation && (quaternion.norm() - 1.0).abs() < 0.1;
    Imu {
        orientation: is_rotation.then(|| UnitQuaternion::new_normalize(quaternion)),
        orientation_covariance: covariance_of(&imu.orientation_covariance).filter(|_| is_rotation),
        angular_velocity_covariance: covariance_of(&imu.angular_velocity_covariance),
        linear_acceleration_covariance: covariance_of(&imu.linear_acceleration_covariance),
        ..Imu::new(vector_of(&imu.angular_velocity), vector_of(&imu.linear_acceleration))
    }
}

fn covariance_of(values: &[f64; 9]) -> Option<Matrix3<f64>> {
    let known = values[0] >= 0.0 && values.iter().all(|value| value.is_finite()) && *values != [0.0; 9];
    known.then(|| Matrix3::from_row_slice(values))
}
