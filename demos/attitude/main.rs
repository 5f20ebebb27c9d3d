//! Orientation from inertial sensors, next to the truth.
//!
//! Without arguments it runs a robot with two simulated IMUs across a fixed joint, each with its filter, and an average
//! of both. With `--data FILE.mcap` a recorded IMU takes their place.

mod arguments;
mod outcome;
#[cfg(feature = "plot")]
mod plot;
#[cfg(feature = "recordings")]
mod recorded;
mod simulated;

use arguments::Arguments;
use std::error::Error;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments = match Arguments::parse(std::env::args().skip(1)) {
        Ok(arguments) => arguments,
        Err((text, true)) => {
            let _ = say(&text);
            return ExitCode::SUCCESS;
        }
        Err((text, false)) => {
            eprint!("{text}");
            return ExitCode::from(2);
        }
    };
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

/// Story of the simulation, printed before it begins.
const STORY: &str = "\
A body with two IMUs, one in its base and one up a mast, turns for a minute. Each has a filter that finds the orientation from it, and
an average joins both. The tables have what was published, and how far each is off the truth.

";

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let params = arguments.params()?;
    if arguments.data.is_none() && !arguments.json {
        say(STORY)?;
    }
    #[cfg(feature = "plot")]
    if let Some(file) = &arguments.plot {
        bb_plot::Picture::check(file, "--plot")?;
    }
    let outcome = match &arguments.data {
        #[cfg(feature = "recordings")]
        Some(file) => recorded::run(file, arguments, params)?,
        _ => simulated::run(arguments, params)?,
    };
    if arguments.json {
        say(&outcome.json())?;
    } else {
        say(&outcome.to_string())?;
    }
    #[cfg(feature = "plot")]
    if let Some(file) = &arguments.plot {
        plot::picture(&outcome)?.write(file)?;
        eprintln!("plotted {}", file.display());
    }
    Ok(())
}
