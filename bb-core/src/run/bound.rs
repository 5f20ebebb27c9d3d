//! Options of components by number, and those that are bound to parameters.

use super::Robot;
use crate::component::{OptionField, OptionsList};
use crate::event::ParameterValue;

/// The paths of a robot's components, in the order of their options.
pub(super) fn component_paths<R: Robot>() -> Vec<&'static str> {
    let sensors = R::SENSORS.iter().map(|declared| declared.path);
    let estimators = R::ESTIMATORS.iter().map(|declared| declared.path);
    let actuators = R::ACTUATORS.iter().map(|declared| declared.path);
    let services = R::SERVICES.iter().map(|declared| declared.path);
    let commands = R::COMMANDS.iter().map(|declared| declared.path);
    sensors.chain(estimators).chain(actuators).chain(services).chain(commands).collect()
}

/// The options of a component.
pub(super) fn fields(options: &mut OptionsList, component: usize) -> &'static [OptionField] {
    options.any(component).map_or(&[], |options| options.fields())
}

/// The path of the parameter that an option is bound to.
pub(super) fn bound_to<R: Robot>(component: usize, path: &str) -> Option<&'static str> {
    let is_bound = |bound: &&(usize, &str, usize)| bound.0 == component && bound.1 == last(path);
    let (_, _, parameter) = R::BOUND_OPTIONS.iter().find(is_bound)?;
    Some(R::PARAMETERS.get(*parameter)?.path)
}

/// Why an option bound to this parameter would refuse its new value. Options of a component that is replaced refuse nothing.
pub(super) fn refused_by_bound<R: Robot>(
    options: &mut OptionsList,
    is_replaced: impl Fn(&str) -> bool,
    parameters: &[ParameterValue],
    path: &str,
) -> Option<String> {
    let paths = component_paths::<R>();
    let number = R::PARAMETERS.iter().position(|declared| declared.path == path)?;
    let value = match parameters.get(number)? {
        ParameterValue::Float(value) => *value,
        ParameterValue::Integer(value) => *value as f64,
        ParameterValue::Bool(_) | ParameterValue::Text(_) => return None,
    };
    R::BOUND_OPTIONS.iter().filter(|bound| bound.2 == number).find_map(|(component, name, _)| {
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
