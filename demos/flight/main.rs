//! A flight whose receiver of satellite navigation is spoofed and whose camera goes blind, as a timeline on a terminal.
//!
//! A drone takes off with satellite navigation, which is then spoofed and refused; it goes on by its camera from one
//! satellite image to the next, loses both in fog, recovers, and lets the receiver in once that is healthy for ten
//! seconds and the next image agrees with it. It runs on virtual time, so that it takes seconds and is the same every time. It
//! fails if any of this did not happen. With `--data` it flies a recorded flight again, whose labels must follow from the times of its
//! measurements.

mod drone;
mod expected;
mod outcome;
mod recorded;
mod sensors;
#[cfg(test)]
mod tests;
mod timeline;
mod trajectory;

use crate::expected::Expected;
use crate::outcome::Outcome;
use crate::recorded::Recorded;
use clap::Parser;
use std::error::Error;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// Flies without satellite navigation, and shows what the state estimator makes of it.
#[derive(Debug, Parser)]
#[command(name = "flight")]
struct Arguments {
    /// Strategy of the estimator: a smoother, or a filter.
    #[arg(long, default_value = "smoother", value_parser = ["smoother", "eskf"])]
    strategy: String,
    /// Flies a recorded flight again in place of the simulated one: the prefix of its CSV files, `folder/name` for
    /// `folder/name_imu.csv` and the others.
    #[arg(long, value_name = "PREFIX")]
    data: Option<PathBuf>,
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

/// Flies, and returns whether all that was expected happened.
fn run(arguments: &Arguments) -> Result<bool, Box<dyn Error>> {
    let (outcome, missing) = match &arguments.data {
        None => {
            let outcome = drone::fly(&arguments.strategy, arguments.record.as_deref())?;
            let missing = missing_simulated(&outcome);
            (outcome, missing)
        }
        Some(prefix) => {
            let recorded = Arc::new(Recorded::read(prefix)?);
            let outcome = drone::fly_recorded(&arguments.strategy, &recorded, arguments.record.as_deref())?;
            let missing = missing_recorded(&outcome, &recorded);
            (outcome, missing)
        }
    };
    // `print!` would panic if the reader of a pipe is gone.
    let mut out = std::io::stdout().lock();
    if arguments.data.is_none() {
        writeln!(out, "{STORY}\n")?;
    }
    for line in outcome.timeline() {
        writeln!(out, "{line}")?;
    }
    let words = outcome.glossary();
    if !words.is_empty() {
        writeln!(out, "\n{words}")?;
    }
    writeln!(out, "\n{}", outcome.errors())?;
    if let Some(file) = &arguments.plot {
        outcome.picture().write(file)?;
    }
    match &missing {
        None => writeln!(out, "\nAll that was expected happened, in its order.")?,
        Some(missing) => writeln!(out, "\nmissing: {missing}")?,
    }
    Ok(missing.is_none())
}

/// Story of the flight, printed before it begins.
const STORY: &str = "\
A drone takes off with satellite navigation. From 20 s on its receiver is spoofed: its fixes are refused, and the drone goes on by
its camera, with an image of the ground from a satellite to compare with every four seconds. From 40 s to 50 s it flies in fog
and sees nothing. At 60 s the receiver is healthy again, and is let in when it has been so for ten seconds and the next image
agrees with it. Times are in seconds.";

/// Time after which fixes are used again, s.
const FIXED_AFTER_S: f64 = 73.0;

/// Describes the first event of the simulated flight that is missing.
fn missing_simulated(outcome: &Outcome) -> Option<String> {
    let fault = |is_fault: bool, text: &str| is_fault.then(|| text.to_owned());
    timeline::missing(&outcome.happened)
        .or_else(|| timeline::unexpected(&outcome.happened))
        .or_else(|| {
            let text = "a covariance that grows while it is dead reckoning";
            fault(!outcome.grows_while_dead_reckoning(), text)
        })
        .or_else(|| fault(!outcome.is_gate_open(), "a receiver that is let in at the end"))
        .or_else(|| fault(!outcome.is_fixed_after(FIXED_AFTER_S), "fixes that are used again"))
}

/// Describes the first fault of a recorded flight, whose labels follow from the times of the measurements.
fn missing_recorded(outcome: &Outcome, recorded: &Recorded) -> Option<String> {
    let start = "started from flight_controller";
    if outcome.happened.iter().filter(|one| one.what.starts_with("started")).any(|one| one.what != start) {
        return Some("one start, from the flight controller".into());
    }
    let length_s = recorded.sent.last().map_or(0.0, |(time, _)| time.as_nanos() as f64 * 1e-9);
    // There are five estimates per second.
    let least = (4.9 * length_s) as usize;
    if outcome.labels().count() < least {
        return Some(format!("{least} estimates"));
    }
    Expected::of(recorded).fault(outcome.labels())
}
