//! Orientation from inertial sensors, next to the truth.
//!
//! Without arguments it runs a robot with two simulated IMUs across a fixed joint, each with its filter, and an average
//! of both. With `--data FILE.mcap` a recorded IMU takes their place.

mod arguments;
mod outcome;
mod plot;
mod recorded;
mod simulated;

use arguments::Arguments;
use bb_cli::Picture;
use clap::Parser;
use std::error::Error;
use std::io::Write;
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

/// Prints; a reader that has read enough (`| head`) is no error.
fn say(text: &str) -> std::io::Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let params = arguments.params()?;
    if let Some(file) = &arguments.plot {
        Picture::check(file, "--plot")?;
    }
    let outcome = match &arguments.data {
        Some(file) => recorded::run(file, arguments, params)?,
        None => simulated::run(arguments, params)?,
    };
    if arguments.json {
        say(&format!("{}\n", serde_json::to_string(&outcome.summary())?))?;
    } else {
        say(&outcome.to_string())?;
    }
    if let Some(file) = &arguments.plot {
        plot::picture(&outcome)?.write(file)?;
        eprintln!("plotted {}", file.display());
    }
    Ok(())
}
