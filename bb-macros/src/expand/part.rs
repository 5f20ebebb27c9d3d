//! The parts of a robot that are declared by a type of the user's, numbered through.

use crate::model::Id as _;
use crate::model::{ActuatorId, CommandId, EstimatorId, Robot, SensorId, ServiceId};
use crate::parse::Component;
use proc_macro2::{Ident, Span, TokenStream};
use quote::{format_ident, quote};

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Sensor(SensorId),
    Estimator(EstimatorId),
    Actuator(ActuatorId),
    Service(ServiceId),
    Command(CommandId),
}

impl Part {
    /// All of a robot, in the order in which their options stand.
    pub(super) fn all(robot: &Robot) -> impl Iterator<Item = Self> + use<> {
        let sensors = robot.sensors.ids().map(Self::Sensor);
        let estimators = robot.estimators.ids().map(Self::Estimator);
        let actuators = robot.actuators.ids().map(Self::Actuator);
        let services = robot.services.ids().map(Self::Service);
        let commands = robot.commands.ids().map(Self::Command);
        sensors.chain(estimators).chain(actuators).chain(services).chain(commands)
    }

    /// Its place among all.
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

    /// The trait that its type implements, and the constant of `bb_core::stub::Probe` that says so.
    pub(super) fn contract(self) -> (TokenStream, TokenStream) {
        match self {
            Self::Sensor(_) => (quote!(::bb_core::Sensor), quote!(IS_SENSOR)),
            Self::Estimator(_) => (quote!(::bb_core::Estimator), quote!(IS_ESTIMATOR)),
            Self::Actuator(_) => (quote!(::bb_core::Actuator), quote!(IS_ACTUATOR)),
            Self::Service(_) => (quote!(::bb_core::Service), quote!(IS_SERVICE)),
            Self::Command(_) => (quote!(::bb_core::Command), quote!(IS_COMMAND)),
        }
    }

    /// `s0`, `e3`: unique in the robot.
    pub(super) fn name(self) -> Ident {
        match self {
            Self::Sensor(id) => format_ident!("s{id}"),
            Self::Estimator(id) => format_ident!("e{id}"),
            Self::Actuator(id) => format_ident!("a{id}"),
            Self::Service(id) => format_ident!("v{id}"),
            Self::Command(id) => format_ident!("c{id}"),
        }
    }

    /// `__RoverS0`: the alias of its type.
    pub(super) fn alias(self, robot: &Ident) -> Ident {
        let name = self.name().to_string().to_uppercase();
        format_ident!("__{robot}{name}", span = Span::call_site())
    }

    /// `__RoverS0Given`: the alias of its type as the user wrote it.
    pub(super) fn given(self, robot: &Ident) -> Ident {
        let alias = self.alias(robot);
        format_ident!("{alias}Given")
    }
}
