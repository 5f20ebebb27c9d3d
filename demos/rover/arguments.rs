//! The command line.

use clap::Parser;
use std::path::PathBuf;

/// Drives a rover through a minute without satellites, and compares its estimate with the truth.
#[derive(Debug, Parser)]
#[command(name = "rover")]
pub(crate) struct Arguments {
    /// Plays a recorded drive instead of the simulation: the prefix of `_imu.csv`, `_gps.csv`, `_keyframes.csv` and `_truth.csv`.
    #[arg(long, value_name = "PREFIX")]
    pub(crate) data: Option<PathBuf>,
    /// Plots the track, and errors within three standard deviations, into this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
}
