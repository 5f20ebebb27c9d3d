//! A robot with resolved names: plain data in lists, with ids for references, and with spans.

mod commands;
mod frames;
mod health;
mod parameters;
mod resolve;
mod rigid;
mod table;
mod trigger;

pub(crate) use commands::{BUILT_IN_STATES, Cancel, Category, CategoryId, Command, CommandId};
pub(crate) use health::{Health, Timing, Worker};
pub(crate) use parameters::{Parameter, ParameterGroup, ParameterGroupId, ParameterId};
pub(crate) use resolve::resolve;
pub(crate) use rigid::Rigid;
pub(crate) use table::{Id, Table};

pub(crate) use table::ids;
pub(crate) use trigger::Trigger;

use crate::language::EstimatorSetting;
use crate::parse::{
    self, Component, Given, JointKind, JointProperties, LinkBody, Output, Path, Quantity, Reactions, ServiceKind,
    Settings, State,
};
use proc_macro2::Ident;
use std::collections::HashMap;
use syn::{Attribute, Visibility};

ids! { LinkId JointId SensorId EstimatorId ServiceId ActuatorId PublisherId }

/// A robot. References between its parts are ids of these lists.
#[derive(Clone, Debug)]
pub(crate) struct Robot {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) visibility: Visibility,
    pub(crate) name: Option<Ident>,
    /// The roots, then in the order of declaration; a verified robot has one root, number 0.
    pub(crate) links: Table<LinkId, Link>,
    pub(crate) joints: Table<JointId, Joint>,
    pub(crate) sensors: Table<SensorId, Sensor>,
    pub(crate) estimators: Table<EstimatorId, Estimator>,
    pub(crate) actuators: Table<ActuatorId, Actuator>,
    /// Controllers and bridges.
    pub(crate) services: Table<ServiceId, Service>,
    pub(crate) parameters: Table<ParameterId, Parameter>,
    pub(crate) parameter_groups: Table<ParameterGroupId, ParameterGroup>,
    /// The number of the parameter at each path, with `::` between the names.
    parameter_paths: HashMap<String, ParameterId>,
    /// Declared states, without the built-in ones.
    pub(crate) states: Vec<State>,
    /// The default one, then the declared ones.
    pub(crate) categories: Table<CategoryId, Category>,
    pub(crate) commands: Table<CommandId, Command>,
    /// Everything that can be subscribed to, sensors first.
    pub(crate) publishers: Table<PublisherId, Publisher>,
    /// All numbers given to words of the language.
    pub(crate) given: Vec<Given>,
    /// All words that are written too often.
    pub(crate) repeated: Vec<Ident>,
    /// `true` if everything could be read; if not, a missing item may have been declared.
    pub(crate) complete: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// Name at run time; differs from the identifier only where a URDF's name is not an identifier.
    pub(crate) label: String,
    /// The joint that carries it; `None` for a root.
    pub(crate) joint: Option<JointId>,
    pub(crate) body: LinkBody,
}

#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    /// Name at run time, as a link's.
    pub(crate) label: String,
    /// `true` if the joint comes from a URDF, which its reader has checked, and where a limit may be a single position.
    pub(crate) from_urdf: bool,
    pub(crate) kind: JointKind,
    pub(crate) kind_word: Ident,
    pub(crate) parent: LinkId,
    pub(crate) children: Vec<LinkId>,
    pub(crate) properties: JointProperties,
}

/// Place at which a sensor is mounted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mount {
    /// The robot as a whole: no frame.
    Robot,
    Link(LinkId),
    /// A joint: fixed to the parent link, at the joint's origin.
    Joint(JointId),
}

#[derive(Clone, Debug)]
pub(crate) struct Sensor {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) mount: Mount,
    /// Type; of an external input, the path.
    pub(crate) component: Component,
    /// The first input that takes it, if it is not declared as a sensor: other code publishes there, with the payload of that input.
    pub(crate) external: Option<(EstimatorId, usize)>,
    /// The time between two calls of `read`, in s; `None` without a rate.
    pub(crate) period_s: Option<f64>,
    pub(crate) publisher: PublisherId,
}

/// A declared actuator, which moves a joint.
#[derive(Clone, Debug)]
pub(crate) struct Actuator {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) joint: JointId,
    pub(crate) component: Component,
    pub(crate) path: Vec<String>,
}

/// A controller or a bridge, which runs beside the topology, in no frame.
#[derive(Clone, Debug)]
pub(crate) struct Service {
    pub(crate) kind: ServiceKind,
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) component: Component,
    /// The time between two calls of `update`, in s; `None` without a rate.
    pub(crate) period_s: Option<f64>,
    pub(crate) publisher: PublisherId,
    pub(crate) path: Vec<String>,
}

/// Place at which an estimator is declared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Home {
    Sensor(SensorId),
    Link(LinkId),
}

#[derive(Clone, Debug)]
pub(crate) struct Estimator {
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) name: Ident,
    pub(crate) home: Home,
    pub(crate) component: Component,
    pub(crate) inputs: Vec<Input>,
    pub(crate) outputs: Vec<Output>,
    /// Settings as written.
    pub(crate) settings: Settings<EstimatorSetting>,
    pub(crate) timing: Timing,
    pub(crate) reactions: Reactions,
    pub(crate) health: Health,
    /// `None` if it runs on its input's thread.
    pub(crate) worker: Option<Worker>,
    /// Path of the estimator itself.
    pub(crate) path: Vec<String>,
    /// One per output; its own path if none is declared.
    pub(crate) publishers: Vec<PublisherId>,
}

#[derive(Clone, Debug)]
pub(crate) struct Input {
    pub(crate) word: Ident,
    pub(crate) name: Ident,
    pub(crate) path: Path,
    /// The word `external`: other code publishes there, not the robot.
    pub(crate) external: Option<Ident>,
    pub(crate) driver: Option<Ident>,
    pub(crate) optional: Option<Ident>,
    pub(crate) within: Option<Quantity>,
    /// `None` if no publisher has that path, or several end in it.
    pub(crate) source: Option<PublisherId>,
    /// The publishers whose paths end in it, if there are several.
    pub(crate) candidates: Vec<PublisherId>,
}

#[derive(Clone, Debug)]
pub(crate) struct Publisher {
    /// Path, name by name.
    pub(crate) path: Vec<String>,
    pub(crate) from: From,
}

/// Part that publishes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum From {
    Sensor(SensorId),
    /// An estimator; with the number of the declared output, if any is declared.
    Estimator(EstimatorId, Option<usize>),
    Service(ServiceId),
}

/// Target of an option that names something by its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    Publisher(PublisherId),
    Actuator(ActuatorId),
    Command(CommandId),
}

impl Robot {
    /// Finds what has this whole path.
    pub(crate) fn target(&self, path: &Path) -> Option<Target> {
        let names: Vec<String> = path.0.iter().map(crate::names::text).collect();
        let publisher = || self.publishers.position(|publisher| publisher.path == names).map(Target::Publisher);
        let actuator = || self.actuators.position(|actuator| actuator.path == names).map(Target::Actuator);
        let command = || self.commands.position(|command| command.path == names).map(Target::Command);
        publisher().or_else(actuator).or_else(command)
    }

    /// The frame in which a publisher's messages are.
    pub(crate) fn mount_of(&self, publisher: PublisherId) -> Mount {
        match self.publishers[publisher].from {
            From::Sensor(sensor) => self.sensors[sensor].mount,
            From::Estimator(estimator, _) => self.mount_of_estimator(estimator),
            From::Service(_) => Mount::Robot,
        }
    }

    /// Everything declared with a type of the user's.
    pub(crate) fn components(&self) -> impl Iterator<Item = &Component> {
        let sensors =
            self.sensors.iter().filter(|sensor| sensor.external.is_none()).map(|sensor| &sensor.component);
        let estimators = self.estimators.iter().map(|estimator| &estimator.component);
        let actuators = self.actuators.iter().map(|actuator| &actuator.component);
        let services = self.services.iter().map(|service| &service.component);
        let commands = self.commands.iter().map(|command| &command.component);
        sensors.chain(estimators).chain(actuators).chain(services).chain(commands)
    }

    pub(crate) fn mount_of_estimator(&self, estimator: EstimatorId) -> Mount {
        match self.estimators[estimator].home {
            Home::Sensor(sensor) => self.sensors[sensor].mount,
            Home::Link(link) => Mount::Link(link),
        }
    }

    /// The name of the frame of a mount.
    pub(crate) fn frame_name(&self, mount: Mount) -> &str {
        match mount {
            Mount::Robot => "",
            Mount::Link(link) => &self.links[link].label,
            Mount::Joint(joint) => &self.joints[joint].label,
        }
    }
}

impl Estimator {
    /// Returns whether the estimator is nested in a sensor.
    pub(crate) fn is_nested(&self) -> bool {
        matches!(self.home, Home::Sensor(_))
    }

    /// The input whose arrival runs it: the one so marked, or the only one.
    pub(crate) fn driver(&self) -> Option<&Input> {
        match &self.inputs[..] {
            [only] => Some(only),
            several => several.iter().find(|input| input.driver.is_some()),
        }
    }
}

impl std::convert::From<parse::Input> for Input {
    fn from(input: parse::Input) -> Self {
        let parse::Input { word, name, path, external, driver, optional, within } = input;
        Self { word, name, path, external, driver, optional, within, source: None, candidates: Vec::new() }
    }
}
