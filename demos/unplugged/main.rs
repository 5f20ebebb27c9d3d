//! Failing sensors and what a robot does then, as a story on a terminal.
//!
//! A rover drives in a circle and estimates its pose from an IMU and its wheels. The wheels stall, the IMU is unplugged,
//! both come back; the health of the estimator starts the commands that slow the rover down, stop it and let it drive on.
//! It runs on virtual time, which takes a moment and gives the same output every time, or in real time with `--real-time`. It fails
//! if an event of the story did not happen in its order.

mod commands;
mod dead_reckoning;
mod expected;
mod rover;
mod run;
mod script;
mod sensors;
#[cfg(test)]
mod tests;
mod timeline;

use bb_core::Builder;
use clap::Parser;
use rover::Rover;
use std::error::Error;
use std::io::Write;
use std::process::ExitCode;

/// Stalls the wheels of a rover, unplugs its IMU, and shows what becomes of it.
#[derive(Debug, Parser)]
#[command(
    name = "unplugged",
    after_help = "Settings of the robot: --config FILE, --set PATH=VALUE, --list, --schema"
)]
struct Arguments {
    /// Takes as long as the story does, instead of running on virtual time.
    #[arg(long)]
    real_time: bool,
}

fn main() -> ExitCode {
    match start(&mut std::io::stdout().lock()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        // The reader has closed the pipe (`| head`), which needs no message.
        Err(error) if error.downcast_ref::<std::io::Error>().is_some_and(is_broken_pipe) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn is_broken_pipe(error: &std::io::Error) -> bool {
    error.kind() == std::io::ErrorKind::BrokenPipe
}

/// Takes the robot's settings from the command line, and the story's own arguments from what is left.
fn start(out: &mut dyn Write) -> Result<bool, Box<dyn Error>> {
    let mut builder = Rover::builder();
    let mut arguments = std::env::args_os();
    let program = arguments.next().unwrap_or_default();
    let Some(others) = builder.take_arguments(arguments)? else { return Ok(true) };
    let arguments = Arguments::parse_from(std::iter::once(program).chain(others));
    tell(builder, &arguments, out)
}

/// The story, printed before it begins.
const STORY: &str = "\
A rover drives in a circle and estimates its pose from an IMU and its wheels. At 2 s the wheels stall: the estimate is degraded, and the
rover slows down until they turn again. At 3 s the IMU is unplugged: the estimate is lost, and the rover stops and refuses to drive.
At 4.5 s the IMU is plugged in, and the rover drives on. Times are in seconds.";

/// Runs the story, and returns whether all of it happened.
fn tell(builder: Builder<Rover>, arguments: &Arguments, out: &mut dyn Write) -> Result<bool, Box<dyn Error>> {
    writeln!(out, "{STORY}\n")?;
    let lines =
        if arguments.real_time { run::in_real_time(builder, out)? } else { run::on_virtual_time(builder, out)? };
    let missing = timeline::missing(expected::EXPECTED, &lines);
    if missing.is_empty() {
        writeln!(out, "\nAll that was expected happened, in its order.")?;
    }
    for (kind, event) in &missing {
        writeln!(out, "\nmissing: {} {event}", kind.name())?;
    }
    Ok(missing.is_empty())
}
