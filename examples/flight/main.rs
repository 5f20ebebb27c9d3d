//! A flight whose receiver of satellite navigation is spoofed and whose camera goes blind, as a timeline on a terminal.
//!
//! A drone takes off with satellite navigation, which is then spoofed and refused; it goes on by its camera from one
//! satellite image to the next, loses both in fog, finds itself again, and lets the receiver in once that is healthy for ten
//! seconds and the next image agrees with it. On virtual time, so that it takes seconds and is the same every time. It
//! fails if that is not what happened.

mod drone;
mod outcome;
mod sensors;
#[cfg(test)]
mod tests;
mod timeline;
mod trajectory;

use clap::Parser;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

/// Flies without satellite navigation, and shows what the state estimator makes of it.
#[derive(Debug, Parser)]
#[command(name = "flight")]
struct Arguments {
    /// What does the work.
    #[arg(long, default_value = "smoother", value_parser = ["smoother", "eskf"])]
    strategy: String,
    /// Records estimates, health and events: a flight-data recorder, MCAP.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Draws error, deviation and anchor age over time (SVG or PNG).
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Flies; whether all happened that should.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let outcome = drone::fly(&arguments.strategy, arguments.record.as_deref())?;
    for line in outcome.timeline() {
        println!("{line}");
    }
    println!("\n{}", outcome.errors());
    if let Some(file) = &arguments.plot {
        outcome.picture().write(file)?;
    }
    let missing = timeline::missing(&outcome.happened).or_else(|| {
        let fault = |is_fault: bool, text: &str| is_fault.then(|| text.to_owned());
        fault(!outcome.grows_while_dead_reckoning(), "a covariance that grows while it is dead reckoning")
            .or_else(|| fault(!outcome.is_gate_open(), "a receiver that is let in at the end"))
    });
    match &missing {
        None => println!("\nAll that was expected happened, in its order."),
        Some(missing) => println!("\nmissing: {missing}"),
    }
    Ok(missing.is_none())
}
