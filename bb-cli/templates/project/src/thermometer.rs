//! The sensor: a thermometer.

use bb_core::prelude::*;

/// Payload of the thermometer: plain data in SI units.
#[derive(Clone, Debug, Payload)]
pub struct Temperature {
    /// K
    pub temperature_k: f64,
}

/// Options are set in the parentheses in `robot!`, and checked at compile time.
#[derive(Clone, Debug, Options)]
pub struct ThermometerOptions {
    /// The largest noise of a reading. Unit: K.
    #[option(default = 0.1, range = 0.0..=10.0, unit = "K")]
    pub noise: f64,
}

/// A simulated thermometer. A real one would hold its device.
#[derive(Debug)]
pub struct Thermometer {
    noise_k: f64,
    readings: u32,
}

impl Sensor for Thermometer {
    type Options = ThermometerOptions;
    type Output = Temperature;

    /// Opens the device; `?` converts any error to a `Fault`, and `map_err` adds the device's name:
    /// `.map_err(|error| Fault::new(format!("opening {}: {error}", options.port)))?`. If it fails at the start, the robot does
    /// not start; after a restart it is retried.
    fn init(options: ThermometerOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { noise_k: options.noise, readings: 0 })
    }

    /// Reads the device, at the rate that the robot declares. An error, for example because the device is unplugged, is
    /// published, and the sensor is created again by `init`.
    fn read(&mut self, _now: MonotonicTime) -> Result<Reading<Temperature>, Fault> {
        self.readings = self.readings.wrapping_add(1);
        let noise = (f64::from(self.readings) * 12.9898).sin();
        Ok(Reading::now(Temperature { temperature_k: 293.15 + self.noise_k * noise }))
    }
}
