//! A sensor that plays the IMU and the magnetometer of a ROS 2 bag.

use bb_bags::{Bag, Messages, RosMessage, ros};
use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use std::path::PathBuf;

pub(crate) const IMU: &str = "sensor_msgs/msg/Imu";
const MAGNETIC_FIELD: &str = "sensor_msgs/msg/MagneticField";

#[derive(Clone, Debug, Options)]
pub(crate) struct BagImuOptions {
    /// The bag.
    #[option(default = "")]
    pub(crate) file: PathBuf,
    /// The topic of the IMU; empty: the only one of its type.
    #[option(default = "")]
    pub(crate) imu_topic: String,
    /// The topic of the magnetometer; empty: the only one of its type.
    #[option(default = "")]
    pub(crate) magnetometer_topic: String,
    /// Whether the bag must have a magnetometer.
    #[option(default = true)]
    pub(crate) magnetometer: bool,
}

/// Plays the samples at their own stamps.
#[derive(Debug)]
pub(crate) struct BagImu {
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
            "" => bag.topic_of(schema).map(|topic| topic.name.to_string()),
            _ => Ok(name),
        };
        let mut topics = vec![topic(options.imu_topic, IMU)?];
        if options.magnetometer {
            let magnetometer = topic(options.magnetometer_topic, MAGNETIC_FIELD);
            topics.push(magnetometer.map_err(|error| format!("{error} (or choose `--axes 6`)"))?);
        }
        Ok(Self { messages: bag.messages(&topics)?, pending: None })
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
                        sample.magnetic_field = Some(MagneticField::new(vector_of(&field.magnetic_field)));
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

fn imu_of(imu: &ros::Imu) -> Imu {
    Imu::new(vector_of(&imu.angular_velocity), vector_of(&imu.linear_acceleration))
}
