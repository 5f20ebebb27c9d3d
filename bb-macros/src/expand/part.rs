//! The parts of a robot declared with a user's type, numbered consecutively.

use crate::model::Id as _;
use crate::model::{ActuatorId, CommandId, EstimatorId, Robot, SensorId, ServiceId};
use crate::parse::Component;
use proc_macro2::TokenStream;
use quote::quote;

/// One of the parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Sensor(SensorId),
    Estimator(EstimatorId),
    Actuator(ActuatorId),
    Service(ServiceId),
    Command(CommandId),
}

impl Part {
    /// All parts of a robot, in the order of their options.
    pub(super) fn all(robot: &Robot) -> impl Iterator<Item = Self> + use<> {
        let sensors = robot.sensors.ids().map(Self::Sensor);
        let estimators = robot.estimators.ids().map(Self::Estimator);
        let actuators = robot.actuators.ids().map(Self::Actuator);
        let services = robot.services.ids().map(Self::Service);
        let commands = robot.commands.ids().map(Self::Command);
        sensors.chain(estimators).chain(actuators).chain(services).chain(commands)
    }

    /// Returns the part's place among all.
    pub(super) fn position(self, robot: &Robot) -> usize {
        let sensors = robot.sensors.len();
        let estimators = sensors + robot.estimators.len();
        let actuators = estimators + robot.actuators.len();
        let services = actuators + robot.services.len();
        match self {
            Self::Sensor(id) => id.number(),
            Self::Estimator(id) => sensors + id.number(),
            Self::Actuator(id) => estimators + id.number(),
            Self::Service(id) => actuators + id.number(),
            Self::Command(id) => services + id.number(),
        }
    }

    pub(super) fn component(self, robot: &Robot) -> &Component {
        match self {
            Self::Sensor(id) => &robot.sensors[id].component,
            Self::Estimator(id) => &robot.estimators[id].component,
            Self::Actuator(id) => &robot.actuators[id].component,
            Self::Service(id) => &robot.services[id].component,
            Self::Command(id) => &robot.commands[id].component,
        }
    }

    /// The trait that its type implements, and the constant of `bb_core::stub::Probe` that is `true` if it does.
    pub(super) fn contract(self) -> (TokenStream, [TokenStream; 2]) {
        match self {
            Self::Sensor(_) => (quote!(::bb_core::Sensor), [quote!(IS_SENSOR), quote!(IMPLEMENTS_SENSOR)]),
            Self::Estimator(_) => {
                (quote!(::bb_core::Estimator), [quote!(IS_ESTIMATOR), quote!(IMPLEMENTS_ESTIMATOR)])
            }
            Self::Actuator(_) => (quote!(::bb_core::Actuator), [quote!(IS_ACTUATOR), quote!(IMPLEMENTS_ACTUATOR)]),
            Self::Service(_) => (quote!(::bb_core::Service), [quote!(IS_SERVICE), quote!(IMPLEMENTS_SERVICE)]),
            Self::Command(_) => (quote!(::bb_core::Command), [quote!(IS_COMMAND), quote!(IMPLEMENTS_COMMAND)]),
        }
    }

    pub(super) fn path(self, robot: &Robot) -> &[String] {
        match self {
            Self::Sensor(id) => &robot.publishers[robot.sensors[id].publisher].path,
            Self::Estimator(id) => &robot.estimators[id].path,
            Self::Actuator(id) => &robot.actuators[id].path,
            Self::Service(id) => &robot.services[id].path,
            Self::Command(id) => &robot.commands[id].path,
        }
    }
}
