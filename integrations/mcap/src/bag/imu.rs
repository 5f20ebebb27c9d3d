//! A sensor that plays back the IMU and the magnetometer of a ROS 2 bag.

use super::Bag;
use super::samples::{IMU, MargSamples};
use bb_core::prelude::*;
use std::path::PathBuf;

/// Options of [`BagImu`].
#[derive(Clone, Debug, Options)]
pub struct BagImuOptions {
    /// The bag, an MCAP file. Must be given, here or before the start.
    #[option(default = "")]
    pub file: PathBuf,
    /// The topic of the IMU. Default: the only one of its type.
    #[option(default = "")]
    pub imu_topic: String,
    /// The topic of the magnetometer. Default: the one that was recorded with the IMU, or the only one of its type.
    #[option(default = "")]
    pub magnetometer_topic: String,
    /// Playback of the magnetometer, which the bag must then contain. Default: yes.
    #[option(default = true)]
    pub magnetometer: bool,
}

/// Plays back a recorded IMU and its magnetometer at the stamps of their headers.
///
/// [`MargSamples`] documents which reading of the magnetometer belongs to which sample. A sample out of order is published
/// with its own stamp, and estimators refuse it.
///
/// ```no_run
/// use bb_mcap::BagImu;
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
pub struct BagImu(MargSamples);

impl Sensor for BagImu {
    type Options = BagImuOptions;
    type Output = Marg;

    fn init(options: BagImuOptions, _: &SensorContext) -> Result<Self, Fault> {
        let bag = Bag::open(&options.file)?;
        let named = |name: &str| Some(name.to_owned()).filter(|name| !name.is_empty());
        let imu = bag.choose(IMU, named(&options.imu_topic).as_deref())?;
        let magnetometer = match options.magnetometer {
            true => Some(&*bag.magnetometer_of(&imu.name, named(&options.magnetometer_topic).as_deref())?.name),
            false => None,
        };
        Ok(Self(MargSamples::read(&bag, &imu.name, magnetometer)?))
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.0.next_time()
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Marg>, Fault> {
        let Some(sample) = self.0.next() else { return Ok(Reading::finished()) };
        let (measured, sample) = sample?;
        Ok(Reading::at(measured, sample).next_at(self.0.next_time().unwrap_or(measured)))
    }
}
