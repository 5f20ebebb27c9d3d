//! All settings of a robot, as a TOML file.

use super::assign::{NULL_TEXT, names, tables};
use crate::component::{OptionField, SettingKind};
use crate::declaration::{Range, unit};
use crate::event::ParameterValue;
use crate::message::codec::to_json;
use crate::run::bound::bound_to;
use crate::run::draft::Draft;
use bb_message::__private::{Sorted, elements_of, members_of};
use std::fmt;

/// All settings of a robot with their values. Its `Display` is a TOML file, with the doc, the range and the unit of each.
#[derive(Clone, Debug, Default)]
pub struct SettingsList {
    tables: Vec<Table>,
}

#[derive(Clone, Debug)]
struct Table {
    /// `[sensor.base.imu]`
    header: String,
    settings: Vec<Line>,
}

#[derive(Clone, Debug)]
struct Line {
    name: &'static str,
    doc: &'static str,
    /// Value in TOML, or the reason for which it cannot be written.
    value: Result<String, String>,
    /// Range and unit.
    limits: String,
}

pub(super) fn list(draft: &mut Draft) -> SettingsList {
    let robot = draft.robot;
    let names = names(robot, &mut draft.options);
    let header = |path: &str| {
        let quoted = |name: &str| if name.contains('/') { to_json(&name.to_owned()) } else { name.to_owned() };
        let names: Vec<String> = tables(&names, path).into_iter().map(quoted).collect();
        format!("[{}]", names.join("."))
    };
    let mut listed = Vec::new();
    let mut declared = (draft.declared_options)();
    let paths = robot.component_paths();
    for (number, path) in paths.into_iter().enumerate() {
        let Some(options) = draft.options.any(number) else { continue };
        let mut declared = declared.any(number);
        let mut is_declared_none = |index| {
            let declared = declared.as_mut().and_then(|options| options.setting(index));
            declared.and_then(|setting| setting.value()).is_some_and(|json| json == "null")
        };
        let fields = options.fields().iter().enumerate();
        let settings: Vec<Line> = fields
            .filter_map(|(index, field)| {
                let mut setting = options.setting(index)?;
                let value = match (bound_to(robot, number, field.name), setting.kind(), setting.value()) {
                    (Some(parameter), ..) => Err(format!("is bound to {parameter}")),
                    (None, SettingKind::Code, _) => Err("can be set in code only".to_owned()),
                    (None, _, None) => Err("has a value that cannot be written".to_owned()),
                    // If commented out, the option would stay as declared.
                    (None, _, Some(json)) if json == "null" && !is_declared_none(index) => {
                        let is_text = setting.set(NULL_TEXT).is_ok();
                        let is_none = setting.set("null");
                        if is_text || is_none.is_err() {
                            Err("is not set".to_owned())
                        } else {
                            Ok(NULL_TEXT.to_owned())
                        }
                    }
                    (None, _, Some(json)) => toml(&json).ok_or_else(|| "is not set".to_owned()),
                };
                Some(Line { name: field.name, doc: field.doc, value, limits: limits_of(field) })
            })
            .collect();
        if !settings.is_empty() {
            listed.push(Table { header: header(path), settings });
        }
    }
    for (declared, value) in robot.parameters.iter().zip(&draft.parameters) {
        let (group, name) = declared.path.rsplit_once('/').unwrap_or(("", declared.path));
        let value = match value {
            ParameterValue::Float(value) if !declared.unit.is_empty() => format!("\"{value} {}\"", declared.unit),
            ParameterValue::Text(text) => quoted(text),
            other => other.to_string(),
        };
        // The range of a parameter is written with its units.
        let limits = limits(declared.range, "");
        let line = Line { name, doc: declared.doc, value: Ok(value), limits };
        let header = header(group);
        match listed.iter_mut().find(|table: &&mut Table| table.header == header) {
            Some(table) => table.settings.push(line),
            None => listed.push(Table { header, settings: vec![line] }),
        }
    }
    SettingsList { tables: listed }
}

fn limits_of(field: &OptionField) -> String {
    let unit = field.dimension.map_or(String::new(), |dimension| unit::si_unit(dimension.exponents));
    limits(field.range, &unit)
}

fn limits(range: Option<Range>, unit: &str) -> String {
    match range {
        Some(range) if unit.is_empty() => range.text.to_owned(),
        Some(range) => format!("{} {unit}", range.text),
        None => String::new(),
    }
}

/// JSON as TOML, which has no null and other objects.
fn toml(json: &str) -> Option<String> {
    match json.chars().next()? {
        'n' => None,
        '[' => {
            let mut items = Vec::new();
            for item in elements_of(json)? {
                items.push(toml(item.get())?);
            }
            Some(format!("[{}]", items.join(", ")))
        }
        '{' => {
            let mut members = Sorted::default();
            // A null value is left out: it is optional.
            for (name, value) in members_of(json)?.iter().filter(|(_, value)| value.get() != "null") {
                members.insert(quoted(name), toml(value.get())?);
            }
            let members: Vec<String> = members.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            Some(format!("{{ {} }}", members.join(", ")))
        }
        '"' => Some(without_delete(json)),
        _ => Some(json.to_owned()),
    }
}

fn quoted(text: &str) -> String {
    without_delete(&to_json(&text.to_owned()))
}

/// A string in quotation marks is the same in JSON and in TOML, except that TOML does not allow DEL in it.
fn without_delete(json: &str) -> String {
    json.replace('\u{7f}', "\\u007F")
}

impl fmt::Display for SettingsList {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, table) in self.tables.iter().enumerate() {
            if index > 0 {
                f.write_str("\n")?;
            }
            writeln!(f, "{}", table.header)?;
            for line in &table.settings {
                for doc in line.doc.lines() {
                    writeln!(f, "# {}", doc.trim())?;
                }
                if !line.limits.is_empty() {
                    writeln!(f, "# In {}.", line.limits)?;
                }
                match &line.value {
                    Ok(value) => writeln!(f, "{} = {value}", line.name)?,
                    Err(reason) => writeln!(f, "# {} {reason}", line.name)?,
                }
            }
        }
        Ok(())
    }
}
