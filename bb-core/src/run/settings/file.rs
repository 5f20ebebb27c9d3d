//! Reads settings from a TOML file.

use super::assign::Assignment;
use super::error::{Place, SettingProblem, SettingsError};
use crate::message::codec::to_json;
use std::collections::HashSet;
use std::sync::Arc;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Meaning of a path.
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
    is_known: &dyn Fn(&str) -> Known,
) -> Result<Vec<Assignment>, SettingsError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let (table, errors) = DeTable::parse_recoverable(text);
    let mut places = Places { name: name.into(), rest: text, at: 0, line: 1, column: 1 };
    let mut reader = Reader { is_known, found: Vec::new() };
    for error in &errors {
        let start = error.span().map_or(0, |span| span.start);
        reader.found.push(Found { start, path: String::new(), text: error.message().to_owned() });
    }
    if errors.is_empty() {
        reader.table("", table.get_ref());
    }
    let mut found = reader.found;
    found.sort_by_key(|found| found.start);
    let (mut assignments, mut problems) = (Vec::new(), Vec::new());
    let mut seen = HashSet::new();
    for Found { start, path, text } in found {
        let place = places.next(start);
        if !errors.is_empty() {
            problems.push(SettingProblem::new(place, "", text));
        } else if !seen.insert(path.clone()) {
            problems.push(SettingProblem::new(place, &path, "is set twice in this file"));
        } else {
            assignments.push(Assignment { place, path, json: text, text: None });
        }
    }
    if problems.is_empty() { Ok(assignments) } else { Err(SettingsError::new(problems)) }
}

/// A part of the text: a setting with its value as JSON, or an error in the syntax.
struct Found {
    start: usize,
    path: String,
    text: String,
}

/// Finds lines and columns, in the order of the text: a file may have hundreds of thousands of settings.
struct Places<'a> {
    name: Arc<str>,
    /// The text from `at` on.
    rest: &'a str,
    at: usize,
    line: usize,
    column: usize,
}

impl Places<'_> {
    /// The place of a byte that is not before the last one.
    fn next(&mut self, at: usize) -> Place {
        if let Some((between, rest)) = at.checked_sub(self.at).and_then(|length| self.rest.split_at_checked(length))
        {
            let lines = between.matches('\n').count();
            let last = between.rsplit('\n').next().unwrap_or("").chars().count();
            self.line += lines;
            self.column = if lines > 0 { 1 } else { self.column } + last;
            (self.rest, self.at) = (rest, at);
        }
        Place::File { name: Arc::clone(&self.name), position: Some((self.line, self.column)) }
    }
}

struct Reader<'a> {
    is_known: &'a dyn Fn(&str) -> Known,
    found: Vec<Found>,
}

impl Reader<'_> {
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
        self.found.push(Found { start, path, text: json(value.get_ref()) });
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
