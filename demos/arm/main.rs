//! A six-axis arm that loses the IMU at its tip while it moves.
//!
//! It follows a path; an estimator across its six joints estimates the acceleration of the tip. The tip's IMU is unplugged in the
//! middle of a leg: the estimator is lost, and the command that this starts stops the arm. When the IMU is back and the
//! estimator has recovered, the arm goes on to the end of its path. It runs on virtual time, which takes a moment and gives the
//! same output every time, or in real time with `--real-time`. With `--record` it writes a recording that Foxglove and RViz can
//! show. It fails if an event of the story did not happen in its order.

mod commands;
mod expected;
mod path;
mod plot;
mod robot;
mod run;
mod script;
#[cfg(test)]
mod tests;
#[path = "../unplugged/timeline.rs"]
mod timeline;
mod tip;

use bb_plot::Picture;
use clap::Parser;
use std::error::Error;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Moves an arm along a path, unplugs the IMU at its tip, and shows what becomes of it.
#[derive(Debug, Parser)]
#[command(name = "arm")]
struct Arguments {
    /// Takes as long as the story does, instead of running on virtual time.
    #[arg(long)]
    real_time: bool,
    /// Records the story to this file, MCAP, which Foxglove and RViz can show; one that is there is replaced.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Plots the positions of the joints into this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
}

fn main() -> ExitCode {
    match tell(&Arguments::parse(), &mut std::io::stdout().lock()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The story, printed before it begins.
const STORY: &str = "\
An arm of six axes follows a path. At 4 s, in the middle of a leg, the IMU at its tip is unplugged: the estimate of the tip is lost, which
stops the arm. At 6 s the IMU is plugged in; as soon as the estimator is healthy, the arm goes on to the end of its path. Times are in
seconds.";

/// Runs the story, and returns whether all of it happened.
fn tell(arguments: &Arguments, out: &mut dyn Write) -> Result<bool, Box<dyn Error>> {
    if let Some(file) = &arguments.plot {
        Picture::check(file, "--plot")?;
    }
    writeln!(out, "{STORY}\n")?;
    let outcome = run::run(arguments, out)?;
    if let Some(file) = &arguments.plot {
        plot::picture(&outcome).write(file)?;
        eprintln!("plotted {}", file.display());
    }
    if let Some(file) = &arguments.record {
        // Not to the output, which is the same on every machine.
        eprintln!("recorded to {}", file.display());
    }
    writeln!(out, "\n{outcome}")?;
    let missing = outcome.missing();
    match missing.as_slice() {
        [] => writeln!(out, "\nAll that was expected happened, in its order.")?,
        missing => missing.iter().try_for_each(|missing| writeln!(out, "\nmissing: {missing}"))?,
    }
    Ok(missing.is_empty())
}
