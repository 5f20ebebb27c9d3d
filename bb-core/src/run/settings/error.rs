//! Errors of settings.

use std::fmt;
use std::sync::Arc;

/// Problems of the settings of a robot, a line each: the first hundred, and how many more there are. `Debug` prints the same as
/// `Display`, since a `main` that returns it shows `Debug`.
#[derive(Clone, PartialEq, Eq)]
pub struct SettingsError {
    problems: Vec<SettingProblem>,
    /// Number of further problems.
    more: usize,
}

/// Number of problems that are kept.
const MOST: usize = 100;

/// One setting that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingProblem {
    place: Place,
    path: String,
    message: String,
}

/// Place at which a setting was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A file.
    #[cfg_attr(not(feature = "toml"), expect(dead_code, reason = "no file is read without the feature"))]
    File {
        name: Arc<str>,
        /// Line and column, from 1; `None` for the file itself.
        position: Option<(usize, usize)>,
    },
    /// The command line.
    Argument,
    /// Code.
    Code,
}

impl SettingsError {
    pub(super) fn new(mut problems: Vec<SettingProblem>) -> Self {
        let more = problems.len().saturating_sub(MOST);
        problems.truncate(MOST);
        Self { problems, more }
    }

    pub(super) fn one(place: Place, path: &str, message: impl Into<String>) -> Self {
        Self::new(vec![SettingProblem::new(place, path, message)])
    }

    #[cfg(feature = "toml")]
    pub(super) fn of_file(name: &str, error: &std::io::Error) -> Self {
        Self::one(Place::File { name: name.into(), position: None }, "", format!("cannot be read: {error}"))
    }

    /// The first hundred, in the order in which they were written.
    pub fn problems(&self) -> &[SettingProblem] {
        &self.problems
    }
}

impl SettingProblem {
    pub(super) fn new(place: Place, path: &str, message: impl Into<String>) -> Self {
        Self { place, path: path.to_owned(), message: message.into() }
    }

    /// The path of the setting; empty if the file itself is wrong.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The problem, and how to solve it.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The line and the column in a file, both from 1.
    pub fn position(&self) -> Option<(usize, usize)> {
        match self.place {
            Place::File { position, .. } => position,
            Place::Argument | Place::Code => None,
        }
    }
}

impl fmt::Display for SettingProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.place {
            Place::File { name, position: Some((line, column)) } => write!(f, "{name}:{line}:{column}: ")?,
            Place::File { name, position: None } => write!(f, "{name}: ")?,
            Place::Argument => f.write_str("--set ")?,
            Place::Code => {}
        }
        if !self.path.is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        f.write_str(&self.message)
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.problems.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            problem.fmt(f)?;
        }
        if self.more > 0 {
            write!(f, "\nand {} more problems", self.more)?;
        }
        Ok(())
    }
}

impl fmt::Debug for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for SettingsError {}
