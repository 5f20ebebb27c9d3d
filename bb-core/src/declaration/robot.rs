//! The whole declaration of a robot.

use super::{
    ActuatorDeclaration, CommandDeclaration, EstimatorDeclaration, ParameterDeclaration, SensorDeclaration,
};
use crate::event::CategoryDeclaration;
use crate::topology::Topology;

/// Everything that `robot!` declares, as constant data: what the runtime knows of a robot without its type.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RobotDeclaration {
    pub(crate) name: &'static str,
    pub(crate) topology: &'static Topology,
    pub(crate) sensors: &'static [SensorDeclaration],
    pub(crate) estimators: &'static [EstimatorDeclaration],
    pub(crate) actuators: &'static [ActuatorDeclaration],
    /// Controllers and bridges.
    pub(crate) services: &'static [SensorDeclaration],
    /// Declared states, without the built-in ones.
    pub(crate) states: &'static [&'static str],
    pub(crate) categories: &'static [CategoryDeclaration],
    pub(crate) commands: &'static [CommandDeclaration],
    pub(crate) parameters: &'static [ParameterDeclaration],
    /// The number of a component, the name of its option, and the number of the parameter that it is bound to.
    pub(crate) bound_options: &'static [(usize, &'static str, usize)],
}

impl RobotDeclaration {
    /// The paths of all components, in the order of their options.
    pub(crate) fn component_paths(&self) -> Vec<&'static str> {
        let mut paths = Vec::new();
        paths.extend(self.sensors.iter().map(|declared| declared.path));
        paths.extend(self.estimators.iter().map(|declared| declared.path));
        paths.extend(self.actuators.iter().map(|declared| declared.path));
        paths.extend(self.services.iter().map(|declared| declared.path));
        paths.extend(self.commands.iter().map(|declared| declared.path));
        paths
    }
}
