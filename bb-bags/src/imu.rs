//! A sensor that plays the IMU and the magnetometer of a ROS 2 bag.

use crate::{Bag, Messages, RosMessage, ros};
use bb_core::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use bb_core::prelude::*;
use std::path::PathBuf;

/// The type of an IMU's topic.
pub const IMU: &str = "sensor_msgs/msg/Imu";
/// The type of a magnetometer's topic.
pub const MAGNETIC_FIELD: &str = "sensor_msgs/msg/MagneticField";

/// Options of [`BagImu`].

#[derive(Clone, Debug, Options)]
pub struct BagImuOptions {
    /// The bag, an MCAP file. Must be given, here or before the start.
    #[option(default = "")]
    pub file: PathBuf,
    /// The topic of the IMU. Default: the only one of its type.
    #[option(default = "")]
    pub imu_topic: String,
    /// The topic of the magnetometer. Default: the only one of its type.
    #[option(default = "")]
    pub magnetometer_topic: String,
    /// Whether to play the magnetometer; the bag must have one then. Default: yes.
    #[option(default = true)]
    pub magnetometer: bool,
}

/// Plays a recorded IMU, and its magnetometer, at the stamps of their headers.
///
/// A reading of the magnetometer goes with the IMU's sample before which, or with which, it was recorded: bags hold
/// messages of one instant in any order, so a sample waits for the next one. A sample out of order is published with
/// its own stamp, and refused by the estimators that take it.
///
/// ```no_run
/// use bb_bags::BagImu;
/// use bb_core::prelude::*;
/// use bb_estimators::Madgwick;
///
/// robot! {
///     robot Recorded;
///     link body {
///         sensor imu: BagImu(file = "walk.mcap") { estimator orientation: Madgwick<Marg>(); }
///     }
/// }
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let builder = Recorded::builder();
///     let orientation = builder.subscribe(recorded::sensor::body::imu::orientation);
///     let mut simulation = builder.simulate()?;
///     while simulation.step() {
///         for orientation in orientation.drain() {
///             println!("{}: {}", orientation.monotonic_time, orientation.world_from_body);
///         }
///     }
///     // A file that is broken in the middle is a fault of the sensor.
///     simulation.stop().ok()?;
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct BagImu {
    messages: Messages,
    /// The sample that waits until it is known which reading of the magnetometer belongs to it.
    pending: Option<(MonotonicTime, Marg)>,
}

impl Sensor for BagImu {
    type Options = BagImuOptions;
    type Output = Marg;

    fn init(options: BagImuOptions, _: &SensorContext) -> Result<Self, Fault> {
        let bag = Bag::open(&options.file)?;
        let topic = |name: String, schema: &str| match name.as_str() {
            "" => Ok(bag.topic_of(schema)?.name.to_string()),
            _ => match bag.topics().iter().find(|topic| *topic.name == *name) {
                Some(topic) if *topic.schema != *schema => {
                    Err(Fault::new(format!("{name} is {}, and {schema} is needed here", topic.schema)))
                }
                // One that is not there is reported where it is read.
                _ => Ok(name),
            },
        };
        let mut topics = vec![topic(options.imu_topic, IMU)?];
        if options.magnetometer {
            topics.push(topic(options.magnetometer_topic, MAGNETIC_FIELD)?);
        }
        let mut bag = Self { messages: bag.messages(&topics)?, pending: None };
        // The first sample, to know when the recording starts.
        let _first = bag.read(MonotonicTime::ZERO)?;
        Ok(bag)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.pending.as_ref().map(|(time, _)| *time)
    }

    /// Gives the sample that waits once the next one is there, with the readings of the magnetometer that came up to
    /// then: bags write messages of one instant in any order.
    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Marg>, Fault> {
        for message in self.messages.by_ref() {
            match message?.payload {
                RosMessage::Imu(imu) => {
                    let time = time_of(imu.header.stamp);
                    let next = (time, Marg { imu: imu_of(&imu), magnetic_field: None });
                    return Ok(match self.pending.replace(next) {
                        Some((measured, sample)) => Reading::at(measured, sample).next_at(time),
                        None => Reading::nothing().next_at(time),
                    });
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
        Ok(match self.pending.take() {
            Some((measured, sample)) => Reading::at(measured, sample).next_at(measured),
            None => Reading::finished(),
        })
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
