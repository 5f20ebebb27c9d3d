//! `--robot`: the options of an estimator in the settings file of a robot.

use crate::suggestion::near;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// `CONFIG.toml`, or `CONFIG.toml:estimator/base/navigation`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotFile {
    file: PathBuf,
    path: Option<String>,
}

impl FromStr for RobotFile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text.rsplit_once(':') {
            Some((file, path)) if path.starts_with("estimator") || path.starts_with("sensor") => {
                Self { file: file.into(), path: Some(path.replace('.', "/")) }
            }
            _ => Self { file: text.into(), path: None },
        })
    }
}

impl RobotFile {
    /// Returns the path of the file.
    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// Reads the options of an estimator in it and their values: of the path that is named, or of the only component that has the
    /// most of its options among those known.
    ///
    /// # Errors
    /// The file cannot be read, has no such estimator or several, or the estimator has unknown options; all of these.
    pub(crate) fn read(&self, known: &[&str]) -> Result<Vec<(String, String)>, String> {
        let name = self.file.display();
        let text = std::fs::read_to_string(&self.file).map_err(|error| format!("{name}: {error}"))?;
        let table: toml::Table = text.parse().map_err(|error| format!("{name}: {error}"))?;
        let mut tables = Vec::new();
        gather(&table, String::new(), &mut tables);
        let is_option = |option: &String| known.contains(&option.as_str());
        let of = match &self.path {
            Some(path) => tables.iter().find(|(other, _)| other == path).ok_or_else(|| {
                let paths: Vec<&str> = tables.iter().map(|(path, _)| path.as_str()).collect();
                format!("{name}: there is no [{}] in it; {}", path.replace('/', "."), near(path, &paths))
            })?,
            None => {
                let share = |(_, options): &(String, toml::Table)| {
                    let fitting = options.keys().filter(|option| is_option(option)).count();
                    fitting as f64 / options.len().max(1) as f64
                };
                let most = tables.iter().map(share).fold(0.0, f64::max);
                let mut fitting: Vec<_> =
                    tables.iter().filter(|table| most > 0.0 && share(table) == most).collect();
                // A listing has all options of each; one may have some of those of another.
                if let Some(whole) = fitting.iter().copied().find(|(_, options)| 2 * options.len() > known.len()) {
                    fitting = vec![whole];
                }
                let paths = || fitting.iter().map(|(path, _)| format!("{name}:{path}")).collect::<Vec<_>>();
                match *fitting {
                    [one] => one,
                    [] => return Err(format!("{name}: no estimator in it has an option of this filter")),
                    _ => {
                        return Err(format!(
                            "{name}: several estimators in it may be this one; name it: --robot {}",
                            paths().join(" or ")
                        ));
                    }
                }
            }
        };
        let (path, options) = of;
        let unknown: Vec<_> = options
            .keys()
            .filter(|option| !is_option(option))
            .map(|option| {
                format!("{name}: {path}/{option}: this filter has no such option; {}", near(option, known))
            })
            .collect();
        if !unknown.is_empty() {
            return Err(unknown.join("\n"));
        }
        let mut settings = Vec::new();
        for (option, value) in options {
            let value = match value {
                toml::Value::String(text) => text.clone(),
                // As JSON, which settings are.
                other => {
                    serde_json::to_string(other).map_err(|error| format!("{name}: {path}/{option}: {error}"))?
                }
            };
            settings.push((option.clone(), value));
        }
        Ok(settings)
    }
}

/// The tables of a settings file by path, each with what is no table in it.
fn gather(table: &toml::Table, path: String, tables: &mut Vec<(String, toml::Table)>) {
    let mut own = toml::Table::new();
    for (key, value) in table {
        let key = key.trim_matches('/');
        match value {
            toml::Value::Table(inner) => {
                let path = if path.is_empty() { key.to_owned() } else { format!("{path}/{key}") };
                gather(inner, path, tables);
            }
            value => drop(own.insert(key.to_owned(), value.clone())),
        }
    }
    tables.push((path, own));
}
