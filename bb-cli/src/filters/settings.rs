//! `--set`: parameters by name.

use super::{Axes, Chosen, Filter, MAGNETOMETER};
use std::str::FromStr;

/// A parameter and its value: of one filter, or of all that have it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    filter: Option<String>,
    name: String,
    value: String,
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
        Ok(Self { filter, name: name.trim().to_owned(), value: value.trim().to_owned() })
    }
}

impl Chosen {
    /// The filters with these settings.
    ///
    /// # Errors
    /// A setting that is of none of them, a value that is refused, or a filter that has not so many axes.
    pub fn all(filters: &[&'static Filter], axes: Axes, settings: &[Setting]) -> Result<Vec<Self>, String> {
        for setting in settings {
            setting.check(filters)?;
        }
        let chosen = filters.iter().map(|filter| {
            if !filter.takes(axes) {
                return Err(format!("{} uses no magnetometer; take it with --axes six", filter.name));
            }
            let mut values: Vec<_> = settings
                .iter()
                .filter(|setting| setting.is_of(filter))
                .map(|setting| (setting.name.clone(), setting.value.clone()))
                .collect();
            if filter.has(MAGNETOMETER) {
                values.push((MAGNETOMETER.into(), (axes == Axes::Nine).to_string()));
            }
            let chosen = Self { filter, values };
            // Made once to see that the values are taken.
            chosen.start().map_err(|fault| format!("{}: {fault}", filter.name))?;
            Ok(chosen)
        });
        chosen.collect()
    }
}

impl Setting {
    fn is_of(&self, filter: &Filter) -> bool {
        self.filter.as_ref().is_none_or(|name| name == filter.name) && filter.has(&self.name)
    }

    fn check(&self, filters: &[&'static Filter]) -> Result<(), String> {
        let Self { filter, name, .. } = self;
        if name == MAGNETOMETER {
            return Err("--set magnetometer is not for the command line; choose --axes six or nine".into());
        }
        if filters.iter().any(|filter| self.is_of(filter)) {
            return Ok(());
        }
        let chosen: Vec<_> = filters.iter().map(|filter| filter.name).collect();
        if let Some(filter) = filter
            && !chosen.contains(&&**filter)
        {
            let near = near(filter, &chosen);
            return Err(format!("--set {filter}.{name}: no filter `{filter}` is chosen; {near}"));
        }
        let of = |candidate: &&&Filter| filter.as_ref().is_none_or(|name| name == candidate.name);
        let among = filters.iter().filter(of).flat_map(|filter| filter.parameters.iter().copied());
        let mut names: Vec<_> = among.filter(|name| *name != MAGNETOMETER).collect();
        names.sort_unstable();
        names.dedup();
        let of = filter.as_ref().map_or_else(|| chosen.join(", "), Clone::clone);
        Err(format!("--set {name}: {of} has no parameter `{name}`; {}", near(name, &names)))
    }
}

/// What a misspelt word may have been meant to be.
pub(crate) fn near(word: &str, candidates: &[&str]) -> String {
    let mut likeness: Vec<_> = candidates.iter().map(|name| (strsim::jaro_winkler(word, name), *name)).collect();
    likeness.sort_by(|a, b| b.0.total_cmp(&a.0));
    match likeness.first() {
        Some((likeness, name)) if *likeness > 0.8 => format!("did you mean `{name}`?"),
        Some(_) => format!("there is {}", candidates.join(", ")),
        None => "there is none".into(),
    }
}

/// Sets a field to what a text says.
pub(super) fn set<T: FromStr>(field: &mut T, value: &str) -> Result<(), String> {
    let kind = match std::any::type_name::<T>() {
        "bool" => "`true` or `false`",
        "f64" => "a number in SI",
        _ => "of another kind",
    };
    *field = value.parse().map_err(|_| format!("but must be {kind}"))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::FILTERS;
    use super::*;

    fn fault(settings: &[&str], names: &[&str]) -> String {
        let filters: Vec<_> = FILTERS.iter().filter(|filter| names.contains(&filter.name)).collect();
        let settings: Result<Vec<Setting>, _> = settings.iter().map(|text| text.parse()).collect();
        match settings.and_then(|settings| Chosen::all(&filters, Axes::Nine, &settings)) {
            Ok(_) => String::new(),
            Err(fault) => fault,
        }
    }

    #[test]
    fn a_setting_reaches_the_filters_that_have_it() {
        assert_eq!(fault(&["beta=0.2"], &["madgwick", "mekf"]), "");
        assert_eq!(fault(&["madgwick.beta = 0.2", "mekf.velocity=0.3"], &["madgwick", "mekf"]), "");
        assert_eq!(fault(&["force_is_mean=false"], &["mekf"]), "");
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
             there is beta, heading_time_constant, tilt_time_constant"
        );
        assert_eq!(
            fault(&["madgwik.beta=0.2"], &["madgwick", "mekf"]),
            "--set madgwik.beta: no filter `madgwik` is chosen; did you mean `madgwick`?"
        );
        assert_eq!(
            fault(&["mekf.beta=0.2"], &["madgwick"]),
            "--set mekf.beta: no filter `mekf` is chosen; there is madgwick"
        );
    }

    #[test]
    fn a_value_that_is_refused_is_named() {
        assert_eq!(fault(&["beta=fast"], &["madgwick"]), "madgwick: `beta` is `fast`, but must be a number in SI");
        assert_eq!(
            fault(&["force_is_mean=1"], &["mekf"]),
            "mekf: `force_is_mean` is `1`, but must be `true` or `false`"
        );
        assert!(fault(&["beta=-1"], &["madgwick"]).ends_with("choose a value from 0 to 1000 rad/s"));
        assert!(fault(&["beta=nan"], &["madgwick"]).ends_with("choose a value from 0 to 1000 rad/s"));
        assert!(fault(&["magnetometer=false"], &["madgwick"]).contains("--axes six"));
        assert!(fault(&["beta"], &["madgwick"]).contains("NAME=VALUE"));
    }
}
