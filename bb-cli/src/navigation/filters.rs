//! The navigation filters by name, and their parameters.

use super::data::DataSet;
use crate::filters::parameters;
use bb_estimators::navigation::{Aiding, EskfParams, Navigator};
use bb_estimators::params::Params;
use std::str::FromStr;

/// A filter that can be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NavigationFilter {
    /// What `--filter` calls it.
    pub name: &'static str,
    /// What it is, in a line.
    pub about: &'static str,
    is_bank: bool,
}

/// All there are; the first is the default.
pub const NAVIGATION_FILTERS: [NavigationFilter; 2] = [
    NavigationFilter {
        name: "eskf",
        about: "error-state Kalman filters over multiples of the data sheets' noise, weighed by their likelihood",
        is_bank: true,
    },
    NavigationFilter {
        name: "eskf-single",
        about: "one error-state Kalman filter with the noise as it is given",
        is_bank: false,
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
    /// The filter for a data set: its noise is that of the set, but for what `settings` say.
    ///
    /// # Errors
    ///
    /// A parameter outside its range.
    pub fn make(&self, data: &DataSet, settings: &[NavigationSetting]) -> Result<Box<Navigator>, String> {
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
        let aiding = if data.relative.is_empty() { Aiding::Gnss } else { Aiding::RelativePoses };
        let made = if self.is_bank { Navigator::new(params, aiding) } else { Navigator::single(params) };
        made.map(Box::new).map_err(|error| error.to_string())
    }
}
