//! The navigation filters by name, and their parameters.

use super::data::DataSet;
use crate::filters::parameters;
use bb_estimators::navigation::{Aiding, EskfParams};
use bb_estimators::params::Params;
use std::str::FromStr;

/// A filter that can be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NavigationFilter {
    /// What `--filter` calls it.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    pub(crate) kind: Kind,
}

/// What a filter is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bank,
    Single,
    Smoother,
    SmootherSingle,
}

/// All there are; the first is the default.
pub const NAVIGATION_FILTERS: [NavigationFilter; 4] = [
    NavigationFilter {
        name: "eskf",
        about: "error-state Kalman filters over multiples of the data sheets' noise, weighed by their likelihood",
        kind: Kind::Bank,
    },
    NavigationFilter {
        name: "eskf-single",
        about: "one error-state Kalman filter with the noise as it is given",
        kind: Kind::Single,
    },
    NavigationFilter {
        name: "smoother",
        about: "a fixed-lag smoother with the noise that those filters have found",
        kind: Kind::Smoother,
    },
    NavigationFilter {
        name: "smoother-single",
        about: "a fixed-lag smoother with the noise as it is given",
        kind: Kind::SmootherSingle,
    },
];

/// A parameter and its value.
#[derive(Clone, Debug, PartialEq)]
pub struct NavigationSetting {
    name: String,
    value: String,
}

impl FromStr for NavigationSetting {
    type Err = String;

    /// `gyroscope_noise=1e-3`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) =
            text.split_once('=').ok_or("no `=` in it; write NAME=VALUE, as gyroscope_noise=1e-3")?;
        let setting = Self { name: name.trim().to_owned(), value: value.trim().to_owned() };
        setting.apply(&mut EskfParams::default())?;
        Ok(setting)
    }
}

impl NavigationSetting {
    fn apply(&self, params: &mut EskfParams) -> Result<(), String> {
        params.set(&self.name, &self.value).map_err(|error| error.to_string())
    }
}

/// The parameters of all of them, for `--list`.
pub(crate) fn listed() -> String {
    parameters(&EskfParams::default(), |_| true)
}

impl NavigationFilter {
    /// Whether it holds a window of keyframes.
    pub(crate) fn is_smoother(&self) -> bool {
        matches!(self.kind, Kind::Smoother | Kind::SmootherSingle)
    }
}

/// The noise of a data set, but for what `settings` say.
///
/// # Errors
///
/// A parameter outside its range.
pub(crate) fn params(data: &DataSet, settings: &[NavigationSetting]) -> Result<EskfParams, String> {
    let mut params = EskfParams {
        gyroscope_noise: data.noise.gyroscope,
        gyroscope_bias_walk: data.noise.gyroscope_bias,
        accelerometer_noise: data.noise.accelerometer,
        accelerometer_bias_walk: data.noise.accelerometer_bias,
        gravity: data.noise.gravity,
        ..EskfParams::default()
    };
    for setting in settings {
        setting.apply(&mut params)?;
    }
    Ok(params)
}

/// What a data set has besides the IMU.
pub(crate) fn aiding(data: &DataSet) -> Aiding {
    if data.relative.is_empty() { Aiding::Gnss } else { Aiding::RelativePoses }
}
