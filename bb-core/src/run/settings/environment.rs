//! Settings from environment variables.

use super::assign::{self, Assignment};
use super::error::{Place, SettingProblem};
use super::{SettingsError, assign::names};
use crate::run::draft::Draft;
use crate::run::{Builder, Robot};
use crate::sorted::Sorted;
use bb_message::__private::nearest;
use std::ffi::{OsStr, OsString};

/// The files to load.
const CONFIG: &str = "BB_CONFIG";
/// The prefix of a variable that sets one option or parameter.
const SET: &str = "BB_SET_";

impl<R: Robot> Builder<R> {
    /// Takes settings from environment variables, usually [`std::env::vars_os`]:
    ///
    /// | variable | effect |
    /// |---|---|
    /// | `BB_CONFIG` | loads these TOML files, separated as in `PATH`, see `load_settings` |
    /// | `BB_SET_…` | sets one option or parameter, after all files: the path with `__` in place of each `/`, as in `BB_SET_param__gains__kp=4.5` |
    ///
    /// The path may also be written in capitals. Other variables are ignored. Call it before
    /// [`take_arguments`](Self::take_arguments), so that the command line has the last word.
    ///
    /// ```
    /// use bb_core::prelude::*;
    ///
    /// robot! {
    ///     robot Rig;
    ///     parameters { gains { kp: f64 = 1.0, range: 0.0..=10.0; } }
    ///     link base;
    /// }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut builder = Rig::builder();
    /// builder.load_environment([("BB_SET_PARAM__GAINS__KP", "4.5")])?;
    /// assert_eq!(builder.simulate()?.parameter(rig::param::gains::kp), 4.5);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// All wrong settings of a file; if the files are right, all variables that name no setting; if all do, all wrong values. Nothing of
    /// that kind is then set; files before a wrong one are loaded.
    pub fn load_environment<N: Into<OsString>, V: Into<OsString>>(
        &mut self,
        variables: impl IntoIterator<Item = (N, V)>,
    ) -> Result<(), SettingsError> {
        // In the order of their names: that of the environment is arbitrary.
        let mut sorted = Sorted::default();
        for (name, value) in variables {
            sorted.insert(name.into(), value.into());
        }
        self.draft.load_environment(&sorted)
    }
}

impl Draft {
    fn load_environment(&mut self, variables: &Sorted<OsString, OsString>) -> Result<(), SettingsError> {
        if let Some(files) = variables.get(OsStr::new(CONFIG)) {
            for file in std::env::split_paths(files).filter(|file| !file.as_os_str().is_empty()) {
                self.load_file(&file)?;
            }
        }
        // Settings by the names of their variables in capitals.
        let mut known: Sorted<String, Vec<String>> = Sorted::default();
        for (path, ()) in names(self.robot, &mut self.options).into_entries() {
            known.get_or_insert(variable(&path).to_uppercase(), Vec::new).push(path);
        }
        let mut assignments: Vec<Assignment> = Vec::new();
        let mut problems = Vec::new();
        for (name, value) in variables.iter() {
            let Some(name) = name.to_str() else {
                if name.as_encoded_bytes().starts_with(SET.as_bytes()) {
                    let place = Place::Variable(name.to_string_lossy().into());
                    problems.push(SettingProblem::new(place, "", "its name is not UTF-8"));
                }
                continue;
            };
            let Some(suffix) = name.strip_prefix(SET) else { continue };
            let place = Place::Variable(name.into());
            match (path_of(&known, suffix), value.to_str()) {
                (Ok(path), Some(_)) if assignments.iter().any(|other| other.path == path) => {
                    problems.push(SettingProblem::new(place, path, "another variable sets it, too"));
                }
                (Ok(path), Some(value)) => assignments.push(Assignment::from_text(place, path, value)),
                (Ok(path), None) => problems.push(SettingProblem::new(place, path, "its value is not UTF-8")),
                (Err(message), _) => problems.push(SettingProblem::new(place, "", message)),
            }
        }
        if !problems.is_empty() {
            return Err(SettingsError::new(problems));
        }
        assign::assign(self, &assignments)
    }
}

/// The path as the name of a variable.
fn variable(path: &str) -> String {
    path.replace('/', "__")
}

/// The setting that a variable means.
fn path_of<'a>(known: &'a Sorted<String, Vec<String>>, suffix: &str) -> Result<&'a str, String> {
    let capitals = suffix.to_uppercase();
    let Some(paths) = known.get(&capitals) else {
        let near = nearest(&capitals, known.iter().map(|(name, _)| name.as_str()));
        return Err(match near.and_then(|near| known.get(near)?.first()) {
            Some(near) => format!("there is no such setting; did you mean `{SET}{}`?", variable(near)),
            None => "there is no such setting; `--list` shows all".to_owned(),
        });
    };
    // Names that differ by their case, or by where a `/` is.
    let exact: Vec<&String> = paths.iter().filter(|path| variable(path) == suffix).collect();
    match (paths.as_slice(), exact.as_slice()) {
        ([path], _) => Ok(path),
        (_, [path]) => Ok(path),
        _ => Err(format!("it means each of {}; set them in a file or with `--set`", paths.join(", "))),
    }
}
