//! Options of components by number, and those that are bound to parameters.

use crate::component::{OptionField, OptionsList};
use crate::declaration::RobotDeclaration;
use crate::event::ParameterValue;

/// The options of a component.
pub(super) fn fields(options: &mut OptionsList, component: usize) -> &'static [OptionField] {
    options.any(component).map_or(&[], |options| options.fields())
}

/// The path of the parameter that an option is bound to.
pub(super) fn bound_to(robot: &RobotDeclaration, component: usize, path: &str) -> Option<&'static str> {
    let is_bound = |bound: &&(usize, &str, usize)| bound.0 == component && bound.1 == last(path);
    let (_, _, parameter) = robot.bound_options.iter().find(is_bound)?;
    Some(robot.parameters.get(*parameter)?.path)
}

/// Returns the reason for which an option bound to this parameter would refuse its new value. Options of a component that is
/// replaced refuse nothing.
pub(super) fn refused_by_bound(
    robot: &RobotDeclaration,
    options: &mut OptionsList,
    is_replaced: &dyn Fn(&str) -> bool,
    parameters: &[ParameterValue],
    path: &str,
) -> Option<String> {
    let paths = robot.component_paths();
    let number = robot.parameters.iter().position(|declared| declared.path == path)?;
    let value = match parameters.get(number)? {
        ParameterValue::Float(value) => *value,
        ParameterValue::Integer(value) => *value as f64,
        ParameterValue::Bool(_) | ParameterValue::Text(_) => return None,
    };
    robot.bound_options.iter().filter(|bound| bound.2 == number).find_map(|(component, name, _)| {
        let path = paths.get(*component).filter(|path| !is_replaced(path))?;
        let fields = fields(options, *component).iter();
        let range = fields.filter(|field| field.name == *name).find_map(|field| field.range)?;
        let is_inside = (range.start..=range.end).contains(&value);
        (!is_inside)
            .then(|| format!("{path}/{name} is bound to it, and must be in {}, found `{value}`", range.text))
    })
}

fn last(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}
