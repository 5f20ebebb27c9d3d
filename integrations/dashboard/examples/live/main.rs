//! A simulated rover with its dashboard: it drives, loses sensors, slows down, stops, and recovers, over and over.
//!
//! `cargo run --release -p bb-dashboard --example live`, then open the printed address. `--port N` chooses another port, `--seconds N` ends
//! it. `bb top`, `bb topic`, `bb param` and `bb command` take the same address.

mod commands;
mod estimators;
mod robot;
mod sensors;

use bb_core::DynamicSubscription;
use bb_core::prelude::*;
use bb_dashboard::{Dashboard, DashboardOptions};
use robot::{Rover, rover};
use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;

/// Command line.
#[derive(Debug, Default, PartialEq)]
struct Arguments {
    port: Option<u16>,
    seconds: Option<u64>,
}

impl Arguments {
    fn parse(mut given: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments = Self::default();
        while let Some(name) = given.next() {
            let mut number = || {
                let value = given.next().ok_or_else(|| format!("`{name}` needs a number"))?;
                value.parse::<u64>().map_err(|_| format!("`{name}` needs a number, found `{value}`"))
            };
            match name.as_str() {
                "--port" => {
                    let port = number()?;
                    arguments.port = Some(u16::try_from(port).map_err(|_| format!("{port} is no port"))?);
                }
                "--seconds" => arguments.seconds = Some(number()?),
                other => return Err(format!("`{other}` is unknown: expected `--port N` or `--seconds N`")),
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
    let builder = Rover::builder();
    let transitions = builder.subscribe_any(Select::Path("health"), None, Overflow::default());
    let running = builder.start()?;
    let mut options = DashboardOptions::defaults();
    options.port = arguments.port.unwrap_or(options.port);
    options.meshes = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/live/meshes").to_owned();
    let dashboard = Dashboard::serve(&running, options)?;
    println!("to steer: {}", dashboard.url());
    println!("to read:  {}", dashboard.reading_url());
    std::thread::sleep(Duration::from_secs(1));
    running.arm()?;
    running.command(rover::command::drive, NoArguments)?;
    let end = arguments.seconds.and_then(|seconds| Instant::now().checked_add(Duration::from_secs(seconds)));
    while end.is_none_or(|end| Instant::now() < end) {
        narrate(&transitions);
    }
    drop(dashboard);
    running.stop();
    Ok(())
}

/// Prints changes of health for a while.
fn narrate(transitions: &DynamicSubscription) {
    if let Some(message) = transitions.recv_timeout(Duration::from_millis(200))
        && let Some(transition) = message.downcast::<HealthTransition>()
    {
        println!("{}", transition.payload);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_read_or_refused() {
        let parse = |text: &str| Arguments::parse(text.split_whitespace().map(str::to_owned));
        assert_eq!(parse("--port 0 --seconds 3"), Ok(Arguments { port: Some(0), seconds: Some(3) }));
        assert_eq!(parse("--port 70000"), Err("70000 is no port".to_owned()));
        assert_eq!(parse("--seconds"), Err("`--seconds` needs a number".to_owned()));
        assert!(parse("--fast").is_err());
    }

    /// Twice through its troubles, on virtual time: it is lost and recovers by itself.
    #[test]
    fn it_loses_sensors_and_recovers() -> Result<(), Box<dyn Error>> {
        let mut simulation = Rover::builder().simulate()?;
        let health = simulation.subscribe(system::Health);
        simulation.arm()?;
        simulation.command(rover::command::drive, NoArguments)?;
        simulation.run_for(2 * sensors::CYCLE);
        let lost = |path: &str| {
            let all = health.drain().map(|message| message.payload).collect::<Vec<_>>();
            all.iter().filter(|change| change.estimator == path && change.to == HealthState::Lost).count()
        };
        assert_eq!(lost("estimator/base/pose"), 2);
        let report = simulation.report();
        assert_eq!(
            report.estimator("estimator/base/pose").and_then(|pose| pose.health),
            Some(HealthState::Healthy)
        );
        assert!(report.source("sensor/base/sonar").is_some_and(|sonar| sonar.restarts > 0));
        assert_eq!(report.state, "driving");
        Ok(())
    }
}
