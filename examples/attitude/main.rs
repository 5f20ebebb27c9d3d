//! Orientation from inertial sensors, next to the truth.
//!
//! Without arguments it runs a robot with two simulated IMUs across a fixed joint, each with its filter, and an average
//! of both. With `--data FILE.mcap` a recorded IMU takes their place.

mod arguments;
mod filter;
mod outcome;
mod plot;
mod progress;
mod recorded;
mod simulated;

use arguments::Arguments;
use clap::Parser;
use std::error::Error;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let params = arguments.params()?;
    let outcome = match &arguments.data {
        Some(file) => recorded::run(file, arguments, params)?,
        None => simulated::run(params)?,
    };
    if arguments.json {
        println!("{}", serde_json::to_string(&outcome.summary())?);
    } else {
        print!("{outcome}");
    }
    if let Some(file) = &arguments.plot {
        plot::plot(file, &outcome)?;
        eprintln!("plotted {}", file.display());
    }
    Ok(())
}
