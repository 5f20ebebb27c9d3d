//! `bb info`: the contents of recordings, and anything that looks wrong in them.

mod date;
mod offset;
mod quantities;
mod remark;
mod report;
mod scan;
mod signals;
mod times;

use bb_eval::files;
use clap::Args;
use std::path::PathBuf;

/// Describes recordings: topics, types, frames, rates, and what looks wrong: gaps, clocks, units, latencies between
/// sensors, covariances that fixes do not keep to, uncalibrated magnetometers, damage.
#[derive(Debug, Args)]
#[command(after_help = "Exit code: 0; 1 if a file is damaged or could not be read; 2 for a wrong use.")]
pub(crate) struct Arguments {
    /// Recordings or ROS 2 bags, or folders of them.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// Prints an array of objects instead of the tables.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, String> {
    let mut is_whole = true;
    let mut contents = Vec::new();
    for (file, found) in files::recordings(&arguments.files) {
        match found.and_then(|()| scan::scan(&file)) {
            Ok(content) => {
                is_whole &= content.damage.is_none();
                contents.push(content);
            }
            Err(fault) => {
                is_whole = false;
                eprintln!("error: {}: {fault}", file.display());
            }
        }
    }
    crate::say(&if arguments.json { report::json(&contents)? } else { report::text(&contents) })?;
    Ok(is_whole)
}
