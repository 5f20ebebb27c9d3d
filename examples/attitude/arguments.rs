//! The command line.

use crate::filter::{ChosenParams, Kind};
use bb_cli::Axes;
use clap::Parser;
use std::path::PathBuf;

/// Estimates orientation from inertial sensors and compares it with the truth.
#[derive(Debug, Parser)]
#[command(name = "attitude")]
pub(crate) struct Arguments {
    /// Plays this ROS 2 bag (MCAP) as the sensor, instead of the simulation.
    #[arg(long, value_name = "FILE.mcap")]
    pub(crate) data: Option<PathBuf>,
    /// The topic of the IMU, where the bag has several.
    #[arg(long, value_name = "TOPIC", requires = "data")]
    pub(crate) imu_topic: Option<String>,
    /// The topic of the magnetometer, where the bag has several.
    #[arg(long, value_name = "TOPIC", requires = "data")]
    pub(crate) mag_topic: Option<String>,
    /// The filter.
    #[arg(long, value_enum, default_value_t = Kind::Madgwick)]
    pub(crate) filter: Kind,
    /// Six axes: gyroscope and accelerometer. Nine: the magnetometer as well.
    #[arg(long, value_enum, default_value_t = Axes::Nine)]
    axes: Axes,
    /// Madgwick's step, rad/s. [default: 0.12]
    #[arg(long, allow_negative_numbers = true)]
    beta: Option<f64>,
    /// Plots truth and estimate over time into this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Prints one JSON object instead of the tables.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Arguments {
    /// The filter that was asked for.
    pub(crate) fn params(&self) -> Result<ChosenParams, String> {
        let mut params =
            ChosenParams { kind: self.filter, magnetometer: self.axes == Axes::Nine, ..ChosenParams::default() };
        match (self.beta, self.filter) {
            (Some(_), kind) if kind != Kind::Madgwick => {
                Err("--beta belongs to --filter madgwick; leave it out".into())
            }
            (Some(beta), _) if !(0.0..=1e3).contains(&beta) => {
                Err(format!("--beta is {beta}, but must be in 0..=1000 rad/s"))
            }
            (beta, _) => {
                params.beta = beta.unwrap_or(params.beta);
                Ok(params)
            }
        }
    }
}
