//! Applies settings to options and parameters: all of them, or none.

use super::error::{Place, SettingProblem, SettingsError};
use crate::component::{AnyOptions, OptionsList, quantity};
use crate::declaration::{ParameterDeclaration, ParameterDefault, RobotDeclaration, parameter_from_json, unit};
use crate::event::ParameterValue;
use crate::message::codec::to_json;
use crate::run::bound::{bound_to, fields, refused_by_bound};
use crate::run::draft::Draft;
use bb_message::__private::{Sorted, nearest, nearest_path};

/// Text by which a file writes `None` for an option that may be `None`.
pub(super) const NULL_TEXT: &str = "\"null\"";

/// Number of unknown names that are compared with all known ones.
const HINTS: usize = 32;

/// A setting as written.
pub(super) struct Assignment {
    pub(super) place: Place,
    pub(super) path: String,
    /// Value.
    pub(super) json: String,
    /// Another possible meaning: a string without quotation marks.
    pub(super) text: Option<String>,
}

impl Assignment {
    /// Creates an assignment of JSON, or else of a plain text.
    pub(super) fn from_text(place: Place, path: &str, value: &str) -> Self {
        let text = to_json(&value.to_owned());
        let path = path.to_owned();
        match serde_json::from_str::<serde_core::de::IgnoredAny>(value) {
            Ok(_) => Self { place, path, json: value.trim().to_owned(), text: Some(text) },
            Err(_) => Self { place, path, json: text, text: None },
        }
    }

    fn problem(&self, message: impl Into<String>) -> SettingProblem {
        SettingProblem::new(self.place.clone(), &self.path, message)
    }
}

/// The paths of all settings.
pub(super) fn names(robot: &RobotDeclaration, options: &mut OptionsList) -> Sorted<String, ()> {
    let paths = robot.component_paths().into_iter().enumerate();
    let mut names = Sorted::default();
    for (component, path) in paths {
        for field in fields(options, component) {
            names.insert(format!("{path}/{}", field.name), ());
        }
    }
    for declared in robot.parameters {
        names.insert(declared.path.to_owned(), ());
    }
    names
}

/// The tables of the settings at `path`, from the outermost: `sensor`, `base` and `imu`. If one of these is itself a setting, such as an
/// option with the name of a nested estimator, the whole path is one name.
pub(super) fn tables<'a>(names: &Sorted<String, ()>, path: &'a str) -> Vec<&'a str> {
    let mut ends = path.match_indices('/').map(|(end, _)| end).chain([path.len()]);
    let is_in_the_way = ends.any(|end| names.get(&path[..end]).is_some());
    if is_in_the_way { vec![path] } else { path.split('/').collect() }
}

/// Returns whether a setting is below this path.
#[cfg(feature = "toml")]
pub(super) fn is_beginning(names: &Sorted<String, ()>, path: &str) -> bool {
    let start = format!("{path}/");
    names.iter().any(|(name, ())| name.starts_with(&start))
}

/// Sets all of `assignments`, or none if one of them is wrong.
pub(super) fn assign(draft: &mut Draft, assignments: &[Assignment]) -> Result<(), SettingsError> {
    let robot = draft.robot;
    let names = names(robot, &mut draft.options);
    let paths = robot.component_paths();
    let mut problems = Vec::new();
    let mut unknown_names = 0;
    let mut parameters = draft.parameters.clone();
    // The changed options of a component, and what changed them.
    let mut changed: Sorted<usize, (Box<dyn AnyOptions>, Vec<&Assignment>)> = Sorted::default();
    for assignment in assignments {
        let target = target(robot, &paths, &mut draft.options, &assignment.path);
        let result = match target {
            Some(Target::Parameter(number)) => parameter(&robot.parameters[number], assignment).map(|value| {
                parameters[number] = value;
            }),
            Some(Target::Option { component, field }) => match bound_to(robot, component, &assignment.path) {
                Some(bound) => Err(format!("is bound to `{bound}`; set that")),
                None => match draft.options.any(component) {
                    Some(options) => {
                        let (copy, by) = changed.get_or_insert(component, || (options.copy(), Vec::new()));
                        by.push(assignment);
                        option(copy.as_mut(), field, assignment).and_then(|()| in_range(copy.as_mut(), field))
                    }
                    None => Err("has no options".to_owned()),
                },
            },
            None if unknown_names < HINTS => {
                unknown_names += 1;
                Err(unknown(&names, &paths, &assignment.path))
            }
            None => Err("there is no such setting".to_owned()),
        };
        if let Err(message) = result {
            problems.push(assignment.problem(message));
        }
    }
    if problems.is_empty() {
        for (component, (copy, by)) in changed.iter() {
            // Ranges were checked above: this error is about options that contradict each other, or a value set by
            // code.
            if let Err(message) = copy.validate()
                && let Some(first) = by.first()
            {
                problems.push(SettingProblem::new(first.place.clone(), paths[*component], message));
            }
        }
        for assignment in assignments {
            if let Some(message) = refused_by_bound(
                robot,
                &mut draft.options,
                &|path| draft.replacements.get(path).is_some(),
                &parameters,
                &assignment.path,
            ) {
                problems.push(assignment.problem(message));
            }
        }
    }
    if !problems.is_empty() {
        return Err(SettingsError::new(problems));
    }
    for (component, (copy, _)) in changed.into_entries() {
        if let Some(options) = draft.options.any(component) {
            options.replace(copy);
        }
    }
    draft.parameters = parameters;
    Ok(())
}

enum Target {
    Parameter(usize),
    Option { component: usize, field: usize },
}

fn target(robot: &RobotDeclaration, paths: &[&str], options: &mut OptionsList, path: &str) -> Option<Target> {
    if let Some(number) = robot.parameters.iter().position(|declared| declared.path == path) {
        return Some(Target::Parameter(number));
    }
    let (component, name) = path.rsplit_once('/')?;
    let component = paths.iter().position(|path| *path == component)?;
    let field = fields(options, component).iter().position(|field| field.name == name)?;
    Some(Target::Option { component, field })
}

/// Checks that a numeric option is within its range.
fn in_range(options: &mut dyn AnyOptions, field: usize) -> Result<(), String> {
    let Some(declared) = options.fields().get(field).copied() else { return Ok(()) };
    let number = options.setting(field).and_then(|setting| setting.number());
    match (declared.range, number) {
        (Some(range), Some(number)) if !(range.start..=range.end).contains(&number) => {
            let unit = declared.dimension.map_or(String::new(), |dimension| unit::si_unit(dimension.exponents));
            Err(format!("must be in {} {unit}", range.text).trim_end().to_owned() + &format!(", found `{number}`"))
        }
        _ => Ok(()),
    }
}

fn option(options: &mut dyn AnyOptions, field: usize, assignment: &Assignment) -> Result<(), String> {
    let Some(mut setting) = options.setting(field) else {
        return Err("can be set in code only: its options are not derived".to_owned());
    };
    let set = setting.set(&assignment.json);
    match (&set, &assignment.text) {
        (Err(_), Some(text)) if setting.set(text).is_ok() => Ok(()),
        // TOML has no null: this string means it, unless the option is a string.
        (Err(_), None) if assignment.json == NULL_TEXT && setting.set("null").is_ok() => Ok(()),
        _ => set,
    }
}

fn parameter(declared: &ParameterDeclaration, assignment: &Assignment) -> Result<ParameterValue, String> {
    let read = |json: &str| match declared.default {
        ParameterDefault::Float(_) if !declared.unit.is_empty() => {
            let (exponents, _) = unit::parse_unit(declared.unit)?;
            quantity(json, exponents).map(ParameterValue::Float)
        }
        default => parameter_from_json(&default.into(), json).map_err(|error| error.to_string()),
    };
    let value = read(&assignment.json);
    let value = match (&value, &assignment.text) {
        (Err(_), Some(text)) => read(text).or(value)?,
        _ => value?,
    };
    declared.check(&value).map_err(|error| error.message)?;
    Ok(value)
}

/// Returns the fault of a path that names no setting.
fn unknown(names: &Sorted<String, ()>, paths: &[&str], path: &str) -> String {
    if paths.contains(&path) {
        let options = options_of(names, path);
        return match options.is_empty() {
            true => "is a component without options".to_owned(),
            false => format!("is a component; its options are {}", options.join(", ")),
        };
    }
    if let Some((component, name)) = path.rsplit_once('/')
        && paths.contains(&component)
    {
        let options = options_of(names, component);
        return match nearest(name, options.iter().copied()) {
            Some(near) => format!("there is no such option; did you mean `{near}`?"),
            None if options.is_empty() => format!("there is no such option; {component} has none"),
            None => format!("there is no such option; the options of {component} are {}", options.join(", ")),
        };
    }
    match nearest_path(path, names.iter().map(|(name, ())| name.as_str())) {
        Some(near) => format!("there is no such setting; did you mean `{near}`?"),
        None => "there is no such setting; `--list` shows all".to_owned(),
    }
}

/// The names of a component's options.
fn options_of<'a>(names: &'a Sorted<String, ()>, component: &str) -> Vec<&'a str> {
    let mut options = Vec::new();
    for (name, ()) in names.iter() {
        match name.rsplit_once('/') {
            Some((path, option)) if path == component => options.push(option),
            _ => {}
        }
    }
    options
}
