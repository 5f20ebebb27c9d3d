//! The command `bb`: inspects, plots and converts recordings, evaluates filters on them, and creates projects. The
//! guide is `book/src/reference/command.md`; that of `bb eval`, which is `bb-eval` on the command line, is `book/src/how-to/evaluate.md`.

// A robot must not stop because of an unexpected value.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod arguments;
mod calibrate;
mod commands;
mod families;
mod live;
mod navigation;
mod noise;
mod topics;
mod values;

use arguments::{Attitude, Job};
use bb_eval::{evaluate_all, export_attitude, files, plot_errors, report};
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Runs the command with these arguments, the first of which is its name. The exit code is 2 for wrong arguments, and
/// 1 for a recording that could not be evaluated to its end.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let job = match arguments::parse(arguments) {
        Ok(job) => job,
        Err(error) => {
            // The terminal may be gone.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let done = match &job {
        Job::Attitude(attitude) => eval_attitude(attitude),
        Job::Families(families) => families.run().and_then(|(text, is_whole)| Ok(say(&text)? && is_whole)),
        Job::Navigation(navigation) => navigation.run().and_then(|(text, is_whole)| Ok(say(&text)? && is_whole)),
        Job::Noise(noise) => noise.run().and_then(|(text, is_whole)| Ok(say(&text)? && is_whole)),
        Job::Print(text) => say(text),
        Job::Other(command) => command.run(),
        Job::Live(command) => command.run(),
        Job::Calibrate(calibrate) => calibrate.run().and_then(|(text, is_any)| Ok(say(&text)? && is_any)),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Evaluates attitude filters; returns whether every recording could be evaluated to its end.
fn eval_attitude(attitude: &Attitude) -> Result<bool, String> {
    let Attitude { paths, evaluator, json, plot, export } = attitude;
    let files = files::recordings(paths);
    let evaluations = evaluate_all(&files, evaluator);
    let text = if *json { report::json(&evaluations)? } else { report::table(&evaluations, evaluator.axes) };
    say(&text)?;
    let is_whole = report::complain(&evaluations, &evaluator.without);
    if let Some(plot) = plot {
        plot_errors(plot, &evaluations, evaluator.axes)?;
        eprintln!("plotted {}", plot.display());
    }
    if let Some(export) = export {
        let rows = export_attitude(export, &evaluations)?;
        eprintln!("wrote {rows} estimates to {}", export.display());
    }
    Ok(is_whole)
}

/// Prints, and returns whether the output is still open: a closed pipe (`| head`) is not an error.
pub(crate) fn say(text: &str) -> Result<bool, String> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(format!("cannot print: {error}")),
    }
}
