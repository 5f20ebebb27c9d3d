//! A rover that nodes of ROS 2 drive: `cargo run --example rover`, then `drive_rover.py` beside
//! this file, or `ros2 topic list`, with `RMW_IMPLEMENTATION=rmw_zenoh_cpp`.
//!
//! `--listen ENDPOINT` replaces `tcp/127.0.0.1:7447`, `--rate HERTZ` sets the rate of the IMU, and `--simulate` runs on virtual time, a
//! little faster than real time. `--interfaces FOLDER` writes the package of the types that ROS does not have, and exits.

use bb_core::nalgebra::Vector3;
use bb_core::prelude::*;
use bb_core::{Bus, Options};
use bb_zenoh::{Ros2Bridge, Ros2Options, write_interfaces};
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// The way ahead.
#[derive(Clone, Copy, Debug, PartialEq, Payload)]
struct Plan {
    /// Metres.
    #[payload(unit = "m")]
    distance: f64,
}

/// Publishes the motion that follows from the commanded one.
struct Follow;

impl Estimator for Follow {
    type Options = NoOptions;
    type Input = Twist;
    type Output = Twist;

    fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> {
        Ok(Self)
    }

    fn handle_input(&mut self, target: &Stamped<Twist>) -> Result<Reply<Twist>, Fault> {
        Ok(Reply::emit(target.payload))
    }
}

/// Arguments of [`Drive`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Payload)]
struct Distance {
    /// Metres, ahead.
    #[payload(unit = "m", range = 0.0..=10.0)]
    distance: f64,
}

/// Drives ahead: a metre in a tenth of a second.
struct Drive;

impl Command for Drive {
    type Options = NoOptions;
    type Arguments = Distance;
    type Output = f64;

    async fn run(_: NoOptions, of: Distance, context: CommandContext) -> Result<Outcome<f64>, Fault> {
        context.bus().publisher("sensor/base/plan")?.publish(Plan { distance: of.distance });
        context.sleep(Duration::from_secs_f64(of.distance / 10.0)).await;
        Ok(Outcome::done(of.distance))
    }
}

/// Turns around.
struct Turn;

impl Command for Turn {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
        context.sleep(Duration::from_millis(200)).await;
        Ok(Outcome::done(()))
    }
}

/// Goes back to where it was.
struct GoHome;

impl Command for GoHome {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        Err(Fault::new("it has nowhere to go back to"))
    }
}

robot! {
    robot Rover;
    parameters {
        /// Gain of its turns.
        kp: f64 = 1.0, range: 0.0..=10.0;
        gains { ki: f64 = 0.1; }
    }
    commands {
        drive: Drive;
        turn: Turn;
        go_home: GoHome;
    }
    link base {
        sensor imu: External<Imu>();
        sensor target: External<Twist>();
        sensor plan: External<Plan>();
        estimator motion: Follow() { input target: sensor::base::target; }
    }
}

/// Command line.
struct Arguments {
    listen: String,
    rate: f64,
    is_simulated: bool,
    interfaces: Option<PathBuf>,
}

impl Arguments {
    fn parse(mut given: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments = Self { listen: String::new(), rate: 200.0, is_simulated: false, interfaces: None };
        while let Some(name) = given.next() {
            let mut value = || given.next().ok_or_else(|| format!("`{name}` needs a value"));
            match name.as_str() {
                "--listen" => arguments.listen = value()?,
                "--rate" => {
                    let value = value()?;
                    let rate = value.parse().ok().filter(|rate: &f64| (0.1..=1e5).contains(rate));
                    arguments.rate = rate.ok_or_else(|| format!("`{value}` is no rate in hertz"))?;
                }
                "--interfaces" => arguments.interfaces = Some(value()?.into()),
                "--simulate" => arguments.is_simulated = true,
                other => {
                    return Err(format!(
                        "`{other}` is unknown: expected `--listen`, `--rate`, `--interfaces` or `--simulate`"
                    ));
                }
            }
        }
        Ok(arguments)
    }
}

fn main() -> ExitCode {
    let run = Arguments::parse(std::env::args().skip(1)).map_err(Into::into).and_then(|arguments| run(&arguments));
    match run {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    if let Some(folder) = &arguments.interfaces {
        let robot = Rover::builder().simulate()?;
        for file in write_interfaces(&robot, folder)? {
            println!("{}", file.display());
        }
        return Ok(());
    }
    let options = Ros2Options {
        listen: arguments.listen.clone(),
        rights: "parameters commands arm".into(),
        publish: "sensor estimator".into(),
        subscribe: "sensor/base/target".into(),
        ..Ros2Options::defaults()
    };
    let period = Duration::from_secs_f64(1.0 / arguments.rate);
    if arguments.is_simulated {
        let mut simulation = Rover::builder().simulate()?;
        let bridge = announced(&simulation, options)?;
        for count in 0.. {
            measure(&simulation, count)?;
            simulation.run_for(period.mul_f64(1.25));
            std::thread::sleep(period);
        }
        drop(bridge);
        return Ok(());
    }
    let running = Rover::builder().start()?;
    let _bridge = announced(&running, options)?;
    let mut next = Instant::now();
    for count in 0.. {
        measure(&running, count)?;
        next += period;
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
    }
    Ok(())
}

fn announced(robot: &Bus, options: Ros2Options) -> Result<Ros2Bridge, Box<dyn Error>> {
    let bridge = Ros2Bridge::serve(robot, options)?;
    println!("{} at {}", bridge.node(), bridge.endpoints().join(" "));
    Ok(bridge)
}

/// An IMU that counts its measurements in the acceleration.
fn measure(robot: &Bus, count: u32) -> Result<(), Fault> {
    let acceleration = Vector3::new(f64::from(count), 0.0, 9.81);
    let imu = Imu::new(Vector3::new(0.0, 0.0, 0.1), acceleration);
    robot.publisher("sensor/base/imu")?.publish(imu);
    Ok(())
}
