//! The command line, read by hand: a crate for it would take longer to build than the rest.

use bb_estimators::attitude::AnyParams;
use bb_eval::{Axes, Chosen, Setting};
use std::path::PathBuf;

const HELP: &str = "Estimates orientation from inertial sensors and compares it with the truth.

Usage: attitude [OPTIONS]

Options:
      --filter <NAME>      The filter; `bb eval attitude --help` says which there are [default: mekf]
      --axes <6|9>         Gyroscope and accelerometer alone, or the magnetometer as well [default: 9]
      --set <NAME=VALUE>   Sets a parameter of the filter, in SI or with a unit; `bb eval attitude --list` prints them
      --json               Prints one JSON object instead of the tables
      --data <FILE.mcap>   Plays this ROS 2 bag as the sensor, instead of the simulation (feature `recordings`)
      --imu-topic <TOPIC>  The topic of the IMU, where the bag has several
      --mag-topic <TOPIC>  The topic of the magnetometer, where the bag has several
      --plot <FILE>        Plots truth and estimate over time into this file, an SVG or a PNG (feature `plot`)
  -h, --help               Prints this
";

/// The program's arguments.
#[derive(Debug)]
pub(crate) struct Arguments {
    filter: String,
    pub(crate) axes: Axes,
    settings: Vec<Setting>,
    pub(crate) json: bool,
    pub(crate) data: Option<PathBuf>,
    pub(crate) imu_topic: Option<String>,
    pub(crate) mag_topic: Option<String>,
    pub(crate) plot: Option<PathBuf>,
}

impl Arguments {
    /// Reads them; the error is what to print instead of a run, and whether it is the help that was asked for.
    pub(crate) fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Self, (String, bool)> {
        Self::read(arguments).map_err(|fault| match fault {
            None => (HELP.into(), true),
            Some(fault) => (format!("error: {fault}\n\nFor more information, try '--help'.\n"), false),
        })
    }

    /// The error is the fault; none if help was asked for.
    fn read(arguments: impl IntoIterator<Item = String>) -> Result<Self, Option<String>> {
        let mut parsed = Self {
            filter: "mekf".into(),
            axes: Axes::Nine,
            settings: Vec::new(),
            json: false,
            data: None,
            imu_topic: None,
            mag_topic: None,
            plot: None,
        };
        let mut arguments = arguments.into_iter();
        while let Some(argument) = arguments.next() {
            let (option, joined) = match argument.split_once('=') {
                Some((option, value)) if option.starts_with("--") => (option, Some(value.to_owned())),
                _ => (&*argument, None),
            };
            let mut value = || {
                let value = joined.clone().or_else(|| arguments.next());
                value.ok_or_else(|| Some(format!("{option} needs a value")))
            };
            match option {
                "-h" | "--help" => return Err(None),
                "--json" if joined.is_none() => parsed.json = true,
                "--filter" => parsed.filter = value()?,
                "--axes" => parsed.axes = value()?.parse()?,
                "--set" => parsed.settings.push(value()?.parse()?),
                "--data" => parsed.data = Some(value()?.into()),
                "--imu-topic" => parsed.imu_topic = Some(value()?),
                "--mag-topic" => parsed.mag_topic = Some(value()?),
                "--plot" => parsed.plot = Some(value()?.into()),
                _ => return Err(Some(format!("unexpected argument '{argument}'"))),
            }
        }
        let needs = |option: &str, feature: &str| {
            Err(Some(format!(
                "{option} needs the feature: cargo run --release --features {feature} --example attitude -- …"
            )))
        };
        match &parsed {
            Self { data: None, imu_topic: Some(_), .. } | Self { data: None, mag_topic: Some(_), .. } => {
                Err(Some("a topic is of a bag: name one with --data".into()))
            }
            Self { data: Some(_), .. } if !cfg!(feature = "recordings") => needs("--data", "recordings"),
            Self { plot: Some(_), .. } if !cfg!(feature = "plot") => needs("--plot", "plot"),
            _ => Ok(parsed),
        }
    }

    /// The filter that was asked for.
    pub(crate) fn params(&self) -> Result<AnyParams, String> {
        let filter = *Chosen::named(&self.filter, self.axes, &self.settings)?.params();
        Ok(AnyParams { filter })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Arguments, (String, bool)> {
        Arguments::parse(text.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn options_take_values_in_both_forms() {
        let parsed = parse("--filter madgwick --axes=6 --set beta=0.05 --json").expect("they are right");
        assert_eq!((&*parsed.filter, parsed.axes, parsed.json), ("madgwick", Axes::Six, true));
        assert_eq!(parsed.settings.len(), 1);
        assert!(parsed.params().is_ok());
    }

    #[test]
    fn wrong_options_are_named() {
        for (text, fault) in [
            ("--axes 7", "`7` is no number of axes"),
            ("--filter", "--filter needs a value"),
            ("--imu-topic /imu", "name one with --data"),
            ("--jsn", "unexpected argument '--jsn'"),
            ("bag.mcap", "unexpected argument 'bag.mcap'"),
        ] {
            let (said, is_help) = parse(text).expect_err("it is wrong");
            assert!(said.contains(fault) && !is_help, "{text}: {said}");
        }
        assert!(parse("--help").is_err_and(|(said, is_help)| is_help && said.contains("--mag-topic")));
    }
}
