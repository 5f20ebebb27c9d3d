//! The filters by name, and their settings.

use crate::filters::near;
use crate::navigation::data::Noise;
use crate::robot_file::RobotFile;
use bb_core::prelude::Options;
use bb_core::{Builder, Robot};
use bb_estimators::navigation::NavigationOptions;
use bb_estimators::navigation::planar::PlanarOptions;
use bb_estimators::navigation::state_estimator::FlightOptions;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use super::{Flight, NAVIGATION_PATH, Planar, Spatial};

/// A filter that can be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NavigationFilter {
    /// Name for `--filter`.
    pub name: &'static str,
    /// A description in one line.
    pub about: &'static str,
    pub(super) kind: Kind,
}

/// The kind of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Spatial,
    Planar,
    /// The estimator of flights, with its strategy.
    Flight(&'static str),
}

/// All filters; the first is the default.
pub const NAVIGATION_FILTERS: [NavigationFilter; 4] = [
    NavigationFilter { name: "eskf", about: "`Eskf`: position, velocity and attitude", kind: Kind::Spatial },
    NavigationFilter { name: "planar", about: "`PlanarEkf`: a robot that drives on a plane", kind: Kind::Planar },
    NavigationFilter {
        name: "state-eskf",
        about: "`StateEstimator(strategy = \"eskf\")`: a flight without satellite navigation",
        kind: Kind::Flight("eskf"),
    },
    NavigationFilter {
        name: "state-smoother",
        about: "`StateEstimator(strategy = \"smoother\")`",
        kind: Kind::Flight("smoother"),
    },
];

impl FromStr for NavigationFilter {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let known = NAVIGATION_FILTERS.map(|filter| filter.name);
        let found = NAVIGATION_FILTERS.into_iter().find(|filter| filter.name == name);
        found.ok_or_else(|| format!("no filter `{name}`; {}", near(name, &known)))
    }
}

impl NavigationFilter {
    /// The names of its options.
    pub(super) fn names(&self) -> Vec<&'static str> {
        let fields = match self.kind {
            Kind::Spatial => NavigationOptions::FIELDS,
            Kind::Planar => PlanarOptions::FIELDS,
            Kind::Flight(_) => FlightOptions::FIELDS,
        };
        fields.iter().map(|field| field.name).collect()
    }

    /// Returns whether it has an option.
    pub(crate) fn has(&self, option: &str) -> bool {
        self.names().contains(&option)
    }

    /// The settings of its robot, as far as they can be applied.
    fn listed(&self, settings: &RobotSettings) -> String {
        fn listed<R: Robot>(mut builder: Builder<R>, settings: &RobotSettings, names: &[&str]) -> String {
            // A setting that is refused has been reported by the run.
            let _ = settings.apply(&mut builder, names);
            builder.settings().to_string()
        }
        match self.kind {
            Kind::Spatial => listed(Spatial::builder(), settings, &self.names()),
            Kind::Planar => listed(Planar::builder(), settings, &self.names()),
            Kind::Flight(_) => listed(Flight::builder(), settings, &self.names()),
        }
    }

    /// Returns its options, as a robot lists them: a settings file.
    pub fn options(&self) -> String {
        let text = self.listed(&RobotSettings::default());
        let of_filter = format!("[{}]", NAVIGATION_PATH.replace('/', "."));
        let begin = text.find(&of_filter).unwrap_or(0);
        text.get(begin..).unwrap_or_default().to_owned()
    }
}

/// An option of a filter and its value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NavigationSetting {
    name: String,
    value: String,
    /// The file that it is from.
    file: Option<PathBuf>,
}

impl FromStr for NavigationSetting {
    type Err = String;

    /// `gyroscope_noise=1e-3`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) =
            text.split_once('=').ok_or("no `=` in it; write NAME=VALUE, as gyroscope_noise=1e-3")?;
        Ok(Self { name: name.trim().to_owned(), value: value.trim().to_owned(), file: None })
    }
}

impl fmt::Display for NavigationSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.file {
            Some(file) => write!(f, "{}: {}", file.display(), self.name),
            None => write!(f, "--set {}={}", self.name, self.value),
        }
    }
}

/// The settings of a robot's filter.
#[derive(Clone, Debug, Default)]
pub struct RobotSettings {
    settings: Vec<NavigationSetting>,
    noise_times: Option<f64>,
    /// Options that a recording gives by its IMU and its place, by name.
    recorded: Vec<(&'static str, f64)>,
}

/// The options that are noise of the IMU.
const NOISE: [&str; 4] =
    ["gyroscope_noise", "accelerometer_noise", "gyroscope_bias_walk", "accelerometer_bias_walk"];

impl RobotSettings {
    /// Settings of a file, then single ones, and what the noise of the IMU is multiplied by.
    ///
    /// # Errors
    /// The file cannot be read, or has an option that the filter does not have.
    pub fn new(
        filter: &NavigationFilter,
        file: Option<&RobotFile>,
        settings: &[NavigationSetting],
        noise_times: Option<f64>,
    ) -> Result<Self, String> {
        let mut all = Vec::new();
        if let Some(file) = file {
            let read = file.read(&filter.names())?.into_iter();
            all.extend(read.map(|(name, value)| NavigationSetting {
                name,
                value,
                file: Some(file.file().to_owned()),
            }));
        }
        all.extend_from_slice(settings);
        Ok(Self { settings: all, noise_times, recorded: Vec::new() })
    }

    /// Sets the options of the filter of a robot.
    pub(super) fn apply<R: Robot>(&self, builder: &mut Builder<R>, known: &[&str]) -> Result<(), String> {
        for (name, value) in &self.recorded {
            // Not every filter has them all.
            let unit = match *name {
                "gravity" => " m/s^2",
                "declination" => " rad",
                _ => "",
            };
            if known.contains(name) {
                set(builder, name, &format!("{value:e}{unit}"))?;
            }
        }
        for setting in &self.settings {
            if !known.contains(&&*setting.name) {
                return Err(format!(
                    "--set {}: there is no such option; {}",
                    setting.name,
                    near(&setting.name, known)
                ));
            }
            set(builder, &setting.name, &setting.value).map_err(|fault| match &setting.file {
                Some(file) => format!("{}: {fault}", file.display()),
                None => format!("--set {fault}"),
            })?;
        }
        if let Some(times) = self.noise_times {
            let settings = builder.settings().to_string();
            for name in NOISE {
                let value = settings.lines().rev().find_map(|line| value_of(line, name));
                let Some(value) = value.and_then(|value| value.parse::<f64>().ok()) else { continue };
                set(builder, name, &format!("{:e}", value * times))?;
            }
        }
        Ok(())
    }

    /// Returns the last setting of an option.
    pub(crate) fn setting(&self, name: &str) -> Option<&NavigationSetting> {
        self.settings.iter().rev().find(|setting| setting.name == name)
    }

    /// Returns these options, with the noise of a recording's IMU and its declination (rad) where they give none.
    pub(crate) fn over(&self, noise: Option<&Noise>, declination: Option<f64>) -> Self {
        let of_imu = |noise: &Noise| {
            [
                ("gyroscope_noise", noise.gyroscope),
                ("accelerometer_noise", noise.accelerometer),
                ("gyroscope_bias_walk", noise.gyroscope_bias),
                ("accelerometer_bias_walk", noise.accelerometer_bias),
                ("gravity", noise.gravity),
            ]
        };
        let recorded = noise.map(of_imu).into_iter().flatten();
        let recorded = recorded.chain(declination.map(|declination| ("declination", declination))).collect();
        Self { recorded, ..self.clone() }
    }

    /// Each setting that is not the default, with the settings without it.
    pub(crate) fn each(&self, filter: &NavigationFilter) -> Vec<(&NavigationSetting, Self)> {
        let without = |(index, setting): (usize, _)| {
            let mut others = self.clone();
            others.settings.remove(index);
            (filter.listed(self) != filter.listed(&others)).then_some((setting, others))
        };
        self.settings.iter().enumerate().filter_map(without).collect()
    }
}

fn set<R: Robot>(builder: &mut Builder<R>, name: &str, value: &str) -> Result<(), String> {
    let path = format!("{NAVIGATION_PATH}/{name}");
    builder.set(&path, value).map_err(|error| error.to_string().replace(&path, name))
}

fn value_of<'a>(line: &'a str, name: &str) -> Option<&'a str> {
    let (key, value) = line.split_once('=')?;
    (key.trim() == name).then(|| value.split('#').next().unwrap_or(value).trim())
}
