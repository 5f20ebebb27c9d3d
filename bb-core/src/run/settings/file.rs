//! Reads settings from a TOML file.

use super::assign::Assignment;
use super::error::{Place, SettingProblem, SettingsError};
use crate::message::codec::to_json;
use crate::sorted::Sorted;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// What a path refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// A setting: a table there is its value.
    Setting,
    /// The beginning of one: a table there holds settings.
    Table,
    /// Both: an option has the name of an estimator nested in its sensor. A table is the option's value if written
    /// with nested names, and holds the estimator's settings if its whole path is one name.
    Both,
    /// Neither.
    No,
}

/// All settings of a file, in the order of their lines.
pub(super) fn read(
    name: &str,
    text: &str,
    is_known: impl Fn(&str) -> Known,
) -> Result<Vec<Assignment>, SettingsError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let (table, errors) = DeTable::parse_recoverable(text);
    let mut reader = Reader { name: name.into(), text, is_known, found: Vec::new(), problems: Vec::new() };
    for error in errors {
        let place = reader.place(error.span().map_or(0, |span| span.start));
        reader.problems.push(SettingProblem::new(place, "", error.message()));
    }
    if reader.problems.is_empty() {
        reader.table("", table.get_ref());
    }
    let mut seen = Sorted::default();
    reader.found.sort_by_key(|(start, _)| *start);
    for (_, assignment) in &reader.found {
        if seen.insert(assignment.path.as_str(), ()).is_some() {
            let message = "is set twice in this file";
            let problem = SettingProblem::new(assignment.place.clone(), &assignment.path, message);
            reader.problems.push(problem);
        }
    }
    if reader.problems.is_empty() {
        Ok(reader.found.into_iter().map(|(_, assignment)| assignment).collect())
    } else {
        Err(SettingsError::new(reader.problems))
    }
}

struct Reader<'a, F> {
    name: Arc<str>,
    text: &'a str,
    is_known: F,
    /// With the place in the text.
    found: Vec<(usize, Assignment)>,
    problems: Vec<SettingProblem>,
}

impl<F: Fn(&str) -> Known> Reader<'_, F> {
    fn table(&mut self, above: &str, table: &DeTable<'_>) {
        for (key, value) in table {
            let path = match above {
                "" => key.get_ref().to_string(),
                above => format!("{above}/{}", key.get_ref()),
            };
            match value.get_ref() {
                DeValue::Table(inner) if (self.is_known)(&path) == Known::Table => self.table(&path, inner),
                DeValue::Table(inner) if (self.is_known)(&path) == Known::Both && key.get_ref().contains('/') => {
                    self.table(&path, inner);
                }
                DeValue::Table(inner) if (self.is_known)(&path) == Known::No && !inner.is_empty() => {
                    self.table(&path, inner)
                }
                _ => self.setting(path, key.span().start, value),
            }
        }
    }

    fn setting(&mut self, path: String, start: usize, value: &Spanned<DeValue<'_>>) {
        // An error about a name points at the name, and an error about a value at the value.
        let is_name_known = matches!((self.is_known)(&path), Known::Setting | Known::Both);
        let start = if is_name_known { value.span().start } else { start };
        let place = self.place(start);
        let json = json(value.get_ref());
        self.found.push((start, Assignment { place, path, json, text: None }));
    }

    /// The line and the column of a byte.
    fn place(&self, at: usize) -> Place {
        let before = self.text.get(..at).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        Place::File { name: Arc::clone(&self.name), position: Some((line, column)) }
    }
}

/// A value as JSON. Floats that JSON cannot represent as numbers are strings, as everywhere here.
fn json(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => to_json(&text.to_string()),
        DeValue::Integer(integer) => match i128::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(integer) => integer.to_string(),
            // Larger than any: as a string it is refused with a message of what was expected.
            Err(_) => to_json(&integer.to_string()),
        },
        DeValue::Float(float) => to_json(&float.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => value.to_string(),
        DeValue::Datetime(time) => to_json(&time.to_string()),
        DeValue::Array(items) => {
            let items: Vec<String> = items.iter().map(|item| json(item.get_ref())).collect();
            format!("[{}]", items.join(","))
        }
        DeValue::Table(members) => {
            let members = members.iter();
            let members: Vec<String> = members
                .map(|(key, value)| format!("{}:{}", to_json(&key.get_ref().to_string()), json(value.get_ref())))
                .collect();
            format!("{{{}}}", members.join(","))
        }
    }
}
