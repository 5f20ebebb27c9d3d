//! `--set`: parameters by name.

use super::{Axes, Chosen, MAGNETOMETER};
use crate::suggestion::near;
use bb_estimators::attitude::FilterParams;
use bb_estimators::params::{Params, SetError};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// A parameter and its value: of one filter, or of all that have it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    filter: Option<String>,
    name: String,
    value: String,
    /// The file that it is from.
    file: Option<PathBuf>,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { filter, name, value, file } = self;
        match (file, filter) {
            (Some(file), _) => write!(f, "{}: {name}", file.display()),
            (None, Some(filter)) => write!(f, "--set {filter}.{name}={value}"),
            (None, None) => write!(f, "--set {name}={value}"),
        }
    }
}

/// A filter without one of its settings, to prove that the setting has an effect.
#[derive(Clone, Debug)]
pub struct Without {
    /// The place of the filter among those chosen.
    pub index: usize,
    /// The setting in words.
    pub setting: String,
    /// The filter without it.
    pub filter: Chosen,
}

impl FromStr for Setting {
    type Err = String;

    /// `beta=0.1` or `madgwick.beta=0.1`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (path, value) = text.split_once('=').ok_or("no `=` in it; write NAME=VALUE, as beta=0.1")?;
        let (filter, name) = match path.split_once('.') {
            Some((filter, name)) => (Some(filter.trim().to_owned()), name),
            None => (None, path),
        };
        Ok(Self { filter, name: name.trim().to_owned(), value: value.trim().to_owned(), file: None })
    }
}

impl Setting {
    /// Name of the parameter.
    pub fn name(&self) -> &str {
        &self.name
    }
}

#[cfg(feature = "recordings")]
impl Setting {
    /// Reads the options of a filter from the settings file of a robot.
    ///
    /// # Errors
    /// The file cannot be read, or has no estimator, several, or an option that the filter does not have.
    pub fn of_robot(filter: &FilterParams, robot: &crate::RobotFile) -> Result<Vec<Self>, String> {
        let known: Vec<_> = filter.parameters().iter().map(|row| row.name).collect();
        let read = robot.read(&known)?.into_iter();
        let of = |(name, value)| {
            let file = Some(robot.file().to_owned());
            Self { filter: Some(filter.name().to_owned()), name, value, file }
        };
        Ok(read.map(of).collect())
    }
}

impl Chosen {
    /// The filters with these settings.
    ///
    /// # Errors
    /// No filter has the setting, a value is refused, or a filter does not have that many axes.
    pub fn all(filters: &[FilterParams], axes: Axes, settings: &[Setting]) -> Result<Vec<Self>, String> {
        for setting in settings {
            setting.check(filters)?;
        }
        let chosen = filters.iter().map(|filter| {
            if !axes.suit(filter) {
                return Err(format!("{} uses no magnetometer; take it with --axes six", filter.name()));
            }
            let mut params = *filter;
            let fault = |error: SetError<'_>| format!("{}: {error}", filter.name());
            let of_filter = settings.iter().filter(|setting| setting.is_of(filter));
            let set = of_filter.map(|setting| params.set(&setting.name, &setting.value).map_err(fault));
            let faults: Vec<_> = set.filter_map(Result::err).collect();
            if !faults.is_empty() {
                return Err(faults.join("\n"));
            }
            Self { params }.on(axes)
        });
        chosen.collect()
    }

    /// The filters of [`all`](Self::all) without each of their settings in turn, but for settings that are the default.
    ///
    /// # Errors
    /// As [`all`](Self::all).
    pub fn without_each(
        filters: &[FilterParams],
        axes: Axes,
        settings: &[Setting],
    ) -> Result<Vec<Without>, String> {
        let whole = Self::all(filters, axes, settings)?;
        let mut all = Vec::new();
        for (place, setting) in settings.iter().enumerate() {
            let others: Vec<_> = settings.iter().enumerate().filter(|(other, _)| *other != place).collect();
            let others: Vec<_> = others.into_iter().map(|(_, setting)| setting.clone()).collect();
            for (index, filter) in Self::all(filters, axes, &others)?.into_iter().enumerate() {
                if whole.get(index) != Some(&filter) {
                    all.push(Without { index, setting: setting.to_string(), filter });
                }
            }
        }
        Ok(all)
    }

    /// The filter of this name with these settings.
    ///
    /// # Errors
    /// An unknown name, or a setting refused by [`all`](Self::all).
    pub fn named(name: &str, axes: Axes, settings: &[Setting]) -> Result<Self, String> {
        let names: Vec<_> = FilterParams::ALL.iter().map(|default| default().name()).collect();
        let filter = FilterParams::named(name);
        let filter = filter.ok_or_else(|| format!("no filter `{name}`; {}", near(name, &names)))?;
        Self::all(&[filter], axes, settings)?.pop().ok_or_else(|| format!("no filter `{name}`"))
    }
}

impl Setting {
    fn is_of(&self, filter: &FilterParams) -> bool {
        self.filter.as_ref().is_none_or(|name| name == filter.name()) && filter.get(&self.name).is_some()
    }

    fn check(&self, filters: &[FilterParams]) -> Result<(), String> {
        let Self { filter, name, value, file } = self;
        if file.is_none() && name == MAGNETOMETER && matches!(value.as_str(), "true" | "false" | "none") {
            return Err("--set magnetometer does not choose the axes; choose --axes six or nine".into());
        }
        if filters.iter().any(|filter| self.is_of(filter)) {
            return Ok(());
        }
        let chosen: Vec<_> = filters.iter().map(FilterParams::name).collect();
        if let Some(filter) = filter
            && !chosen.contains(&&**filter)
        {
            let near = near(filter, &chosen);
            return Err(format!("--set {filter}.{name}: no filter `{filter}` is chosen; {near}"));
        }
        let of = |candidate: &&FilterParams| filter.as_ref().is_none_or(|name| name == candidate.name());
        let among = filters.iter().filter(of).flat_map(|filter| filter.parameters().iter().map(|row| row.name));
        let mut names: Vec<_> = among.filter(|name| *name != MAGNETOMETER).collect();
        names.sort_unstable();
        names.dedup();
        let of = filter.as_ref().map_or_else(|| chosen.join(", "), Clone::clone);
        Err(format!("--set {name}: {of} has no parameter `{name}`; {}", near(name, &names)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(settings: &[&str], names: &[&str]) -> String {
        let filters = FilterParams::ALL.iter().map(|default| default());
        let filters: Vec<_> = filters.filter(|filter| names.contains(&filter.name())).collect();
        let settings: Result<Vec<Setting>, _> = settings.iter().map(|text| text.parse()).collect();
        match settings.and_then(|settings| Chosen::all(&filters, Axes::Nine, &settings)) {
            Ok(_) => String::new(),
            Err(fault) => fault,
        }
    }

    #[test]
    fn a_setting_reaches_the_filters_that_have_it() {
        assert_eq!(fault(&["beta=0.2"], &["madgwick", "mekf"]), "");
        assert_eq!(fault(&["madgwick.beta = 0.2", "mekf.declination=3 deg"], &["madgwick", "mekf"]), "");
        assert_eq!(fault(&["magnetometer=calibrated"], &["mekf"]), "");
    }

    #[test]
    fn a_misspelt_name_is_answered_with_the_likely_one() {
        assert_eq!(
            fault(&["betta=0.2"], &["madgwick"]),
            "--set betta: madgwick has no parameter `betta`; did you mean `beta`?"
        );
        assert_eq!(
            fault(&["gain=0.2"], &["madgwick", "complementary"]),
            "--set gain: madgwick, complementary has no parameter `gain`; \
             there are beta, heading_time_constant, tilt_time_constant"
        );
        assert_eq!(
            fault(&["madgwik.beta=0.2"], &["madgwick", "mekf"]),
            "--set madgwik.beta: no filter `madgwik` is chosen; did you mean `madgwick`?"
        );
        assert_eq!(
            fault(&["mekf.beta=0.2"], &["madgwick"]),
            "--set mekf.beta: no filter `mekf` is chosen; there is only madgwick"
        );
    }

    #[test]
    fn a_value_that_is_refused_is_named() {
        assert_eq!(
            fault(&["beta=fast"], &["madgwick"]),
            "madgwick: `beta` is `fast`: write a number from 0 to 1000 rad/s"
        );
        assert_eq!(fault(&["beta=5 deg/s"], &["madgwick"]), "");
        assert!(fault(&["beta=5 deg"], &["madgwick"]).contains("`beta` is `5 deg`: its unit is rad/s"));
        assert_eq!(fault(&["rest_bias=1"], &["vqf"]), "vqf: `rest_bias` is `1`: write `true` or `false`");
        assert_eq!(
            fault(&["magnetometer=good"], &["mekf"]),
            "mekf: `magnetometer` is `good`: write `auto`, `calibrated`, `uncalibrated` or `none`"
        );
        assert!(fault(&["beta=-1"], &["madgwick"]).ends_with("choose a value from 0 to 1000 rad/s"));
        assert!(fault(&["beta=nan"], &["madgwick"]).ends_with("choose a value from 0 to 1000 rad/s"));
        assert!(fault(&["magnetometer=false"], &["madgwick"]).contains("--axes six"));
        assert!(fault(&["beta"], &["madgwick"]).contains("NAME=VALUE"));
    }
}
