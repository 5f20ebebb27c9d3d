//! A rover in Foxglove: `cargo run --example foxglove_rover`, then *Open connection* with `ws://localhost:8765`, and the layout `foxglove_rover.json` beside this file.
//!
//! `--port PORT` is another than 8765, and `--rights RIGHTS` those of clients, by default `parameters commands arm`: with `""`, they only read.

use bb_core::nalgebra::{UnitQuaternion, Vector3};
use bb_core::prelude::*;
use bb_foxglove::Foxglove;
use std::error::Error;
use std::f64::consts::TAU;
use std::process::ExitCode;

/// Seconds of a turn around itself.
const TURN_S: f64 = 20.0;

/// An IMU that counts its measurements in the acceleration.
#[derive(Debug)]
struct CountingImu {
    count: f64,
}

impl Sensor for CountingImu {
    type Options = NoOptions;
    type Output = Imu;

    fn init(_: NoOptions, _: &SensorContext) -> Result<Self, Fault> {
        Ok(Self { count: 0.0 })
    }

    fn read(&mut self, _: MonotonicTime) -> Result<Reading<Imu>, Fault> {
        let acceleration = Vector3::new(self.count, 0.0, 9.81);
        self.count += 1.0;
        Ok(Reading::now(Imu::new(Vector3::new(0.0, 0.0, TAU / TURN_S), acceleration)))
    }
}

/// The heading, from the rate of turn.
#[derive(Debug)]
struct Heading {
    heading: f64,
    last: Option<MonotonicTime>,
}

impl Estimator for Heading {
    type Options = NoOptions;
    type Input = Imu;
    type Output = Orientation;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self { heading: 0.0, last: None })
    }

    fn handle_input(&mut self, imu: &Stamped<Imu>) -> Result<Reply<Orientation>, Fault> {
        let now = imu.monotonic_time;
        let elapsed = self.last.replace(now).map_or(Duration::ZERO, |last| now.duration_since(last));
        self.heading = (self.heading + imu.payload.angular_velocity.z * elapsed.as_secs_f64()) % TAU;
        let world_from_body = UnitQuaternion::from_euler_angles(0.0, 0.0, self.heading);
        Ok(Reply::emit(Orientation { world_from_body, covariance: None }))
    }
}

/// Arguments of [`Drive`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
pub(crate) struct Distance {
    /// Metres, ahead.
    #[payload(unit = "m", range = 0.0..=10.0)]
    distance: f64,
}

/// Drives ahead: a metre in a tenth of a second.
#[derive(Debug)]
pub(crate) struct Drive;

impl Command for Drive {
    type Options = NoOptions;
    type Arguments = Distance;
    type Output = f64;

    async fn run(_: NoOptions, of: Distance, context: CommandContext) -> Result<Outcome<f64>, Fault> {
        if of.distance == 0.0 {
            return Err(Fault::new("it has nowhere to go"));
        }
        context.sleep(Duration::from_secs_f64(of.distance / 10.0)).await;
        Ok(Outcome::done(of.distance))
    }
}

robot! {
    robot Rover;
    parameters {
        /// Speed ahead.
        speed: f64 = 0.5 m/s, range: 0 m/s..=1.5 m/s;
    }
    commands { drive: Drive; }
    bridges { bridge foxglove: Foxglove(rights = "parameters commands arm"); }
    link base {
        sensor imu: CountingImu() { rate: 200 Hz; }
        estimator heading: Heading() { input imu: sensor::base::imu; }
        joint mast: fixed {
            origin: { xyz: [0 m, 0 m, 0.5 m] };
            link camera;
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let mut builder = Rover::builder();
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("`{name}` needs a value"))?;
        match name.as_str() {
            "--port" => {
                builder.options(rover::bridge::foxglove).port =
                    value.parse().map_err(|_| format!("`{value}` is no port"))?
            }
            "--rights" => builder.options(rover::bridge::foxglove).rights = value,
            _ => return Err(format!("`{name}` is unknown: expected `--port` or `--rights`").into()),
        }
    }
    let mut running = builder.start()?;
    running.wait();
    Ok(())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
