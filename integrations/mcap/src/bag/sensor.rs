//! A sensor that plays back any topic of a ROS 2 bag.

use super::{Bag, BagMessages};
use bb_core::prelude::*;
use std::path::PathBuf;

/// Options of [`BagSensor`].
#[derive(Clone, Debug, Options)]
pub struct BagSensorOptions {
    /// The bag, an MCAP file. Must be given, here or before the start.
    #[option(default = "")]
    pub file: PathBuf,
    /// The topic. Default: the only one of its type.
    #[option(default = "")]
    pub topic: String,
}

/// Plays back the messages of a topic as payloads, at the stamps of their headers: fixes, wheels, an IMU without its
/// magnetometer. [`BagImu`](super::BagImu) joins an IMU and its magnetometer.
///
/// The type of the topic is the ROS message that corresponds to the payload; see the table in [`bb_core::message::codec::ros`]. A
/// message out of order is published with its own stamp.
///
/// ```no_run
/// use bb_core::prelude::*;
/// use bb_estimators::Eskf;
/// use bb_mcap::BagSensor;
///
/// robot! {
///     robot Rover;
///     link base {
///         sensor imu: BagSensor<Imu>(file = "drive.mcap");
///         sensor wheels: BagSensor<Odometry>(file = "drive.mcap", topic = "/wheel/odom");
///         joint mast: fixed {
///             origin: { xyz: [-0.3 m, 0.1 m, 1 m] };
///             link antenna { sensor gnss: BagSensor<GnssFix>(file = "drive.mcap"); }
///         }
///         estimator position: Eskf() {
///             input imu: sensor::base::imu, driver;
///             input odometry: sensor::base::wheels, optional;
///             input gnss: sensor::base::mast::antenna::gnss, optional;
///         }
///     }
/// }
///
/// fn main() -> Result<(), Box<dyn std::error::Error>> {
///     let builder = Rover::builder();
///     let odometry = builder.subscribe(rover::estimator::base::position);
///     let mut simulation = builder.simulate()?;
///     while simulation.step() {
///         for odometry in odometry.drain() {
///             println!("{}: {}", odometry.monotonic_time, odometry.pose.position);
///         }
///     }
///     simulation.stop().ok()?;
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct BagSensor<T> {
    messages: BagMessages,
    next: Option<(MonotonicTime, T)>,
}

impl<T: Payload> BagSensor<T> {
    /// Reads the message after the next one, and returns that.
    fn advance(&mut self) -> Result<Option<(MonotonicTime, T)>, Fault> {
        let read = |(payload, time): (T, WallTime)| (MonotonicTime::from_nanos(time.as_unix_nanos()), payload);
        let after = self.messages.next().transpose()?.map(|message| message.payload().map(read)).transpose()?;
        Ok(std::mem::replace(&mut self.next, after))
    }
}

impl<T: Payload> Sensor for BagSensor<T> {
    type Options = BagSensorOptions;
    type Output = T;

    fn init(options: BagSensorOptions, _: &SensorContext) -> Result<Self, Fault> {
        let bag = Bag::open(&options.file)?;
        let named = Some(&*options.topic).filter(|name| !name.is_empty());
        let topic = bag.choose(Stamped::<T>::ros_name().unwrap_or(T::NAME), named)?;
        let mut sensor = Self { messages: bag.messages(&[&topic.name])?, next: None };
        sensor.advance()?;
        Ok(sensor)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.next.as_ref().map(|(time, _)| *time)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<T>, Fault> {
        let Some((measured, payload)) = self.advance()? else { return Ok(Reading::finished()) };
        Ok(Reading::at(measured, payload).next_at(self.starts_at().unwrap_or(measured)))
    }
}
