//! The parameters of the robot, by path.

use bb_core::component::ParameterDescription;
use bb_core::event::ParameterChange;
use bb_core::{Bus, DynamicMessage};
use foxglove::websocket::{
    AnyClient, GetParametersResponder, Parameter, ParameterHandler, ParameterType, ParameterValue,
    SetParametersResponder,
};

/// Answers requests of a client for parameters.
#[derive(Clone)]
pub(crate) struct Parameters(pub(crate) Bus);

impl Parameters {
    /// The values of these parameters; of all if there are no names.
    fn values(&self, names: &[String]) -> Vec<Parameter> {
        let all = self.0.description().parameters;
        let chosen = all.iter().filter(|one| names.is_empty() || names.iter().any(|name| name == one.path));
        chosen.map(|ParameterDescription { path, value, .. }| parameter(path, value)).collect()
    }

    /// Sets parameters, all or none.
    fn set_all(&self, given: &[Parameter]) -> Result<(), String> {
        let json = |parameter: &Parameter| match &parameter.value {
            Some(value) => serde_json::to_string(value).map_err(|error| error.to_string()),
            None => Err(format!("{}: a parameter cannot be removed", parameter.name)),
        };
        let values = given.iter().map(json).collect::<Result<Vec<String>, String>>()?;
        let pairs = given.iter().zip(&values).map(|(parameter, value)| (parameter.name.as_str(), value.as_str()));
        self.0.set_parameters_json(pairs).map_err(|error| error.to_string())
    }
}

impl ParameterHandler for Parameters {
    fn get(&self, _: AnyClient, names: Vec<String>, _: Option<String>, responder: GetParametersResponder) {
        responder.respond(self.values(&names));
    }

    fn set(&self, client: AnyClient, given: Vec<Parameter>, _: Option<String>, responder: SetParametersResponder) {
        let this = self.clone();
        // It waits for the robot.
        tokio::task::spawn_blocking(move || {
            if let Err(why) = this.set_all(&given) {
                // An answer has no place for a reason; to the protocol, it is the old value alone that refuses.
                client.send_warning(why);
            }
            let names: Vec<String> = given.into_iter().map(|parameter| parameter.name).collect();
            responder.respond(if names.is_empty() { Vec::new() } else { this.values(&names) });
        });
    }
}

/// The new value of a parameter, if the event is a change of one.
pub(crate) fn changed(event: &DynamicMessage) -> Option<Parameter> {
    let change = event.downcast::<ParameterChange>()?;
    Some(parameter(change.path, &change.to))
}

fn parameter(path: &str, value: &bb_core::ParameterValue) -> Parameter {
    let (r#type, value) = match value {
        bb_core::ParameterValue::Bool(value) => (None, ParameterValue::Bool(*value)),
        bb_core::ParameterValue::Integer(value) => (None, ParameterValue::Integer(*value)),
        // Named, as JSON does not tell 1.0 from 1.
        bb_core::ParameterValue::Float(value) => (Some(ParameterType::Float64), ParameterValue::Float64(*value)),
        bb_core::ParameterValue::Text(value) => (None, ParameterValue::String(value.clone())),
    };
    Parameter { name: path.to_owned(), r#type, value: Some(value) }
}
