//! Sensors, with and without options.

use bb_core::prelude::*;

/// An inertial sensor with options of every sort.
#[derive(Debug)]
pub struct Bmi270;

/// Options of [`Bmi270`].
#[derive(Clone, Debug, Options)]
pub struct Bmi270Options {
    /// The bus it is on.
    #[option(required)]
    pub bus: String,
    /// The highest angular velocity it measures. Unit: rad/s.
    #[option(default = 35.0, range = 2.0..=35.0, unit = "rad/s")]
    pub full_scale: f64,
    /// Number of samples that are averaged to one.
    #[option(default = 1, range = 1..=16)]
    pub averages: u8,
}

impl Sensor for Bmi270 {
    type Options = Bmi270Options;
    type Output = Imu;

    fn init(_: Bmi270Options, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        Ok(Reading::finished())
    }
}

/// A sensor without options.
#[derive(Debug)]
pub struct Magnetometer;

impl Sensor for Magnetometer {
    type Options = NoOptions;
    type Output = MagneticField;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<MagneticField>, Fault> {
        Ok(Reading::finished())
    }
}

/// A sensor of a joint's position.
#[derive(Debug)]
pub struct Encoder;

impl Sensor for Encoder {
    type Options = NoOptions;
    type Output = JointState;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<JointState>, Fault> {
        Ok(Reading::finished())
    }
}
