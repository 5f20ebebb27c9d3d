//! The parts of a robot that are declared by a type of the user's, numbered through.

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
        let sensors = (0..robot.sensors.len()).map(Self::Sensor);
        let estimators = (0..robot.estimators.len()).map(Self::Estimator);
        let actuators = (0..robot.actuators.len()).map(Self::Actuator);
        let services = (0..robot.services.len()).map(Self::Service);
        let commands = (0..robot.commands.len()).map(Self::Command);
        sensors.chain(estimators).chain(actuators).chain(services).chain(commands)
    }

    /// Its place among all.
    pub(super) fn position(self, robot: &Robot) -> usize {
        let (sensors, estimators) = (robot.sensors.len(), robot.estimators.len());
        let (actuators, services) = (robot.actuators.len(), robot.services.len());
        match self {
            Self::Sensor(id) => id,
            Self::Estimator(id) => sensors + id,
            Self::Actuator(id) => sensors + estimators + id,
            Self::Service(id) => sensors + estimators + actuators + id,
            Self::Command(id) => sensors + estimators + actuators + services + id,
        }
    }

    pub(super) fn component(self, robot: &Robot) -> Option<&Component> {
        match self {
            Self::Sensor(id) => robot.sensors.get(id).map(|sensor| &sensor.component),
            Self::Estimator(id) => robot.estimators.get(id).map(|estimator| &estimator.component),
            Self::Actuator(id) => robot.actuators.get(id).map(|actuator| &actuator.component),
            Self::Service(id) => robot.services.get(id).map(|service| &service.component),
            Self::Command(id) => robot.commands.get(id).map(|command| &command.component),
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
        let (letter, id) = match self {
            Self::Sensor(id) => ('s', id),
            Self::Estimator(id) => ('e', id),
            Self::Actuator(id) => ('a', id),
            Self::Service(id) => ('v', id),
            Self::Command(id) => ('c', id),
        };
        format_ident!("{letter}{id}")
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
