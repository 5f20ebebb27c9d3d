//! The command line.

use bb_cli::{Axes, Chosen, Setting};
use bb_estimators::attitude::AnyParams;
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
    /// The filter; `bb eval attitude --help` says which there are.
    #[arg(long, value_name = "NAME", default_value = "mekf")]
    filter: String,
    /// Gyroscope and accelerometer alone, or the magnetometer as well.
    #[arg(long, value_enum, default_value_t = Axes::Nine)]
    pub(crate) axes: Axes,
    /// Sets a parameter of the filter, in SI or with a unit; `bb eval attitude --list` prints them.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<Setting>,
    /// Plots truth and estimate over time into this file, an SVG or a PNG.
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Prints one JSON object instead of the tables.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Arguments {
    /// The filter that was asked for.
    pub(crate) fn params(&self) -> Result<AnyParams, String> {
        let filter = *Chosen::named(&self.filter, self.axes, &self.settings)?.params();
        Ok(AnyParams { filter })
    }
}
