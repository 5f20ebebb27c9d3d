//! The navigation filters by name, and their parameters.

use super::data::DataSet;
use crate::filters::parameters;
use bb_estimators::navigation::state_estimator::StrategyKind;
use bb_estimators::navigation::{Aiding, EskfParams, NavigationOptions};
use bb_estimators::params::Params;
use std::str::FromStr;

/// A filter that can be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NavigationFilter {
    /// Its name for `--filter`.
    pub name: &'static str,
    /// A description in one line.
    pub about: &'static str,
    pub(crate) kind: Kind,
}

/// The kind of a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bank,
    Single,
    Smoother,
    SmootherSingle,
    State(StrategyKind),
}

/// All filters; the first is the default.
pub const NAVIGATION_FILTERS: [NavigationFilter; 6] = [
    NavigationFilter {
        name: "eskf",
        about: "error-state Kalman filters with multiples of the data sheets' noise, weighted by their likelihood",
        kind: Kind::Bank,
    },
    NavigationFilter {
        name: "eskf-single",
        about: "one error-state Kalman filter with the given noise",
        kind: Kind::Single,
    },
    NavigationFilter {
        name: "smoother",
        about: "a fixed-lag smoother with the noise that the filters of `eskf` found",
        kind: Kind::Smoother,
    },
    NavigationFilter {
        name: "smoother-single",
        about: "a fixed-lag smoother with the given noise",
        kind: Kind::SmootherSingle,
    },
    NavigationFilter {
        name: "state-eskf",
        about: "the state estimator of flights with the filter: its queue, gates and labels around `eskf-single`",
        kind: Kind::State(StrategyKind::Eskf),
    },
    NavigationFilter {
        name: "state-smoother",
        about: "the state estimator of flights with the smoother: its queue, gates and labels around `smoother-single`",
        kind: Kind::State(StrategyKind::FixedLagSmoother),
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
        setting.apply(&mut EskfParams::default(), &mut NavigationOptions::default())?;
        Ok(setting)
    }
}

/// Whether smoothers use landmarks.
const LANDMARKS: &str = "landmarks";

/// Settings for bags only: where filters start, and the noise of topics that report none.
const OF_BAGS: [&str; 6] = [
    "heading",
    "heading_deviation",
    "heading_from_course",
    "gnss_deviation",
    "odometry_deviation",
    "pose_deviation",
];

impl NavigationSetting {
    fn apply(&self, params: &mut EskfParams, options: &mut NavigationOptions) -> Result<(), String> {
        let Self { name, value } = self;
        if name == LANDMARKS {
            return value.parse::<bool>().map(drop).map_err(|_| format!("`{value}` is not `true` or `false`"));
        }
        let set = if OF_BAGS.contains(&&**name) { options.set(name, value) } else { params.set(name, value) };
        set.map_err(|error| error.to_string())
    }
}

/// Whether smoothers use landmarks: yes, unless the last setting says otherwise.
pub(crate) fn uses_landmarks(settings: &[NavigationSetting]) -> bool {
    settings.iter().rfind(|setting| setting.name == LANDMARKS).is_none_or(|setting| setting.value == "true")
}

/// The parameters of all of them, for `--list`.
pub fn navigation_parameters() -> String {
    let of_bags = parameters(&NavigationOptions::default(), |name| OF_BAGS.contains(&name));
    format!(
        "{}\nof smoothers:\n  {LANDMARKS} = true\nof bags:\n{of_bags}",
        parameters(&EskfParams::default(), |_| true)
    )
}

impl NavigationFilter {
    /// Whether it holds a window of keyframes.
    pub fn is_smoother(&self) -> bool {
        matches!(self.kind, Kind::Smoother | Kind::SmootherSingle | Kind::State(StrategyKind::FixedLagSmoother))
    }
}

/// The noise of a data set, overridden by `settings`.
///
/// # Errors
///
/// A parameter outside its range.
pub(crate) fn params(data: &DataSet, settings: &[NavigationSetting]) -> Result<EskfParams, String> {
    let mut params = EskfParams::default();
    if let Some(noise) = &data.noise {
        params = EskfParams {
            gyroscope_noise: noise.gyroscope,
            gyroscope_bias_walk: noise.gyroscope_bias,
            accelerometer_noise: noise.accelerometer,
            accelerometer_bias_walk: noise.accelerometer_bias,
            gravity: noise.gravity,
            ..params
        };
    }
    let mut of_bags = NavigationOptions::default();
    for setting in settings {
        setting.apply(&mut params, &mut of_bags)?;
    }
    Ok(params)
}

/// The parameters of a filter on a bag, and those for values missing in the bag.
///
/// # Errors
///
/// A parameter outside its range.
pub(crate) fn bag_params(settings: &[NavigationSetting]) -> Result<(EskfParams, NavigationOptions), String> {
    let (mut params, mut options) = (EskfParams::default(), NavigationOptions::default());
    for setting in settings {
        setting.apply(&mut params, &mut options)?;
    }
    Ok((params, options))
}

/// The sensors of a data set besides the IMU.
pub(crate) fn aiding(data: &DataSet) -> Aiding {
    if data.relative.is_empty() { Aiding::Gnss } else { Aiding::RelativePoses }
}
