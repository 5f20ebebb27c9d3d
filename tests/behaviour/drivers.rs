//! The serial driver of `book/src/how-to/drivers.md`, on a pseudo-terminal.
#![cfg(unix)]
#![allow(unreachable_pub, reason = "as the guide has it")]

use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use serialport::{SerialPort, TTYPort};
use std::io::{ErrorKind, Read, Write};
use std::path::PathBuf;

#[derive(Clone, Debug, Options)]
pub struct AccelerometerOptions {
    /// Device file, such as `/dev/serial/by-id/usb-…`: unlike `/dev/ttyUSB0`, it still names this device after a reconnect.
    #[option(required)]
    pub port: String,
    #[option(default = 115_200)]
    pub baud: u32,
}

pub struct Accelerometer {
    port: Box<dyn SerialPort>,
    /// Bytes of the next line that have arrived.
    line: Vec<u8>,
}

impl Sensor for Accelerometer {
    type Options = AccelerometerOptions;
    type Output = Accel;

    fn init(options: AccelerometerOptions, _: &SensorContext) -> Result<Self, Fault> {
        // With a timeout, so that `read` returns now and then even if nothing arrives.
        let port = serialport::new(&options.port, options.baud).timeout(Duration::from_millis(50)).open();
        let port = port.map_err(|error| Fault::new(format!("opening {}: {error}", options.port)))?;
        Ok(Self { port, line: Vec::new() })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Accel>, Fault> {
        let mut byte = [0];
        loop {
            match self.port.read(&mut byte) {
                // The device is gone.
                Ok(0) => return Err(Fault::new("the port was closed")),
                Ok(_) if byte == *b"\n" => break,
                // Bounded: noise must not fill the memory.
                Ok(_) if self.line.len() < 256 => self.line.push(byte[0]),
                Ok(_) => self.line.clear(),
                Err(error) if error.kind() == ErrorKind::TimedOut => return Ok(Reading::nothing()),
                Err(error) => return Err(error.into()),
            }
        }
        let line = std::mem::take(&mut self.line);
        // A truncated or garbled line is skipped. If every line is wrong, the sensor is silent, which `lost_after` detects.
        Ok(parse(&line).map_or(Reading::nothing(), Reading::now))
    }
}

/// `0.01,-0.02,1.00`, in g.
fn parse(line: &[u8]) -> Option<Accel> {
    const G: f64 = 9.80665;
    let text = std::str::from_utf8(line).ok()?;
    let numbers: Vec<f64> = text.trim().split(',').map(|number| number.parse().ok()).collect::<Option<_>>()?;
    let [x, y, z] = numbers.try_into().ok()?;
    Some(Accel { linear: Vector3::new(x, y, z) * G, angular: Vector3::zeros(), covariance: None })
}

robot! {
    robot Probe;
    link base {
        sensor accelerometer: Accelerometer(port = "/dev/serial/by-id/usb-…");
    }
}

/// A device and the line to it, whose file is a link, as under `/dev/serial/by-id`.
fn plug_in(link: &PathBuf) -> (TTYPort, TTYPort) {
    let (device, line) = TTYPort::pair().expect("a pseudo-terminal");
    let _ = std::fs::remove_file(link);
    std::os::unix::fs::symlink(line.name().expect("it has a name"), link).expect("a link");
    (device, line)
}

#[test]
fn a_serial_device_is_unplugged_and_comes_back() {
    let link = std::env::temp_dir().join(format!("bb-driver-{}", std::process::id()));
    let (mut device, line) = plug_in(&link);
    let mut builder = Probe::builder();
    builder.options(probe::sensor::base::accelerometer).port = link.display().to_string();
    let faults = builder.subscribe(system::Faults);
    let running = builder.start().expect("the device is there");
    let readings = running.subscribe(probe::sensor::base::accelerometer);
    let received = |device: &mut TTYPort| {
        (0..200).find_map(|_| {
            let _ = device.write_all(b"garbled\n0.0,0.0,1.0\n");
            readings.recv_timeout(Duration::from_millis(50))
        })
    };
    let reading = received(&mut device).expect("it measures");
    assert_eq!(reading.payload.linear, Vector3::new(0.0, 0.0, 9.80665));
    drop((device, line));
    let fault = faults.recv_timeout(Duration::from_secs(10)).expect("it is unplugged");
    assert_eq!(fault.path, "sensor/base/accelerometer");
    let opening = format!("opening {}: ", link.display());
    let fault = faults.recv_timeout(Duration::from_secs(10)).expect("it is not there");
    assert!(fault.message.starts_with(&opening), "{}", fault.message);
    let (mut device, _line) = plug_in(&link);
    readings.drain().for_each(drop);
    assert!(received(&mut device).is_some(), "it comes back");
    let report = running.stop();
    assert!(report.sources[0].restarts >= 1 && report.sources[0].stopped.is_none());
    let _ = std::fs::remove_file(link);
}
