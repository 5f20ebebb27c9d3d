//! A driver of your own: a thermometer that sends two bytes for each reading. `cargo run --example driver`
//!
//! A driver opens its device in `init` and takes one reading in `read`. If either fails it returns the error, without a loop: it is
//! closed and opened again, first after 10 ms.

use bb_core::prelude::*;

/// Payload of the thermometer.
#[derive(Clone, Copy, Debug, Payload)]
struct Temperature {
    /// K
    temperature_k: f64,
}

/// Options are given in the parentheses in `robot!`, which checks their names, units and ranges.
#[derive(Clone, Debug, Options)]
struct ThermometerOptions {
    /// Bytes that the device sends; a real driver would take the name of a port.
    #[option(required)]
    bytes: String,
    /// Added to each reading. Unit: K.
    #[option(default = 0.0, range = -10.0..=10.0, unit = "K")]
    offset: f64,
}

struct Thermometer {
    device: std::io::Cursor<Vec<u8>>,
    offset_k: f64,
}

impl Sensor for Thermometer {
    type Options = ThermometerOptions;
    type Output = Temperature;

    fn init(options: ThermometerOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { device: std::io::Cursor::new(options.bytes.into_bytes()), offset_k: options.offset })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Temperature>, Fault> {
        let mut register = [0; 2]; // 1/16 °C
        std::io::Read::read_exact(&mut self.device, &mut register)?; // any error becomes a `Fault`
        let celsius = f64::from(i16::from_be_bytes(register)) / 16.0;
        Ok(Reading::now(Temperature { temperature_k: celsius + 273.15 + self.offset_k }))
    }
}

robot! {
    robot Oven;
    link body { sensor thermometer: Thermometer(bytes = "\u{1}@\u{1}A\u{1}B", offset = -0.5 K) { rate: 10 Hz; } }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let builder = Oven::builder();
    let temperatures = builder.subscribe(oven::sensor::body::thermometer);
    let mut simulation = builder.simulate()?;
    simulation.run_for(Duration::from_millis(310));
    for temperature in temperatures.drain() {
        let time_s = temperature.monotonic_time.seconds_since(MonotonicTime::ZERO);
        println!("{time_s:.2} s: {:.2} K", temperature.temperature_k);
    }
    let report = simulation.stop();
    println!("restarts: {}", report.sources[0].restarts);
    println!("fault: {}", report.ok().err().map_or("none".into(), |fault| fault.to_string()));
    Ok(())
}
