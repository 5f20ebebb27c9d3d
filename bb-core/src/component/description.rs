//! A running robot as a whole, for tools that do not know its type: what it consists of, and what can be asked of it.

mod json;

use super::CommandInfo;
use crate::event::ParameterValue;
use crate::message::codec::{Layouts, Shape};
use crate::topology::{JointKind, Limit, Origin, Visual};
use std::ops::RangeInclusive;
use std::time::Duration;

/// Everything that a robot consists of, see [`Bus::description`](super::Bus::description). [`Self::to_json`] writes it for
/// other programs.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Description {
    /// The name of the robot.
    pub robot: &'static str,
    /// Kind of the run: in real time, in a simulation or from a journal.
    pub run: RunKind,
    /// Links.
    pub links: Vec<LinkDescription>,
    /// Joints.
    pub joints: Vec<JointDescription>,
    /// Sensors, estimators, actuators, controllers and bridges.
    pub components: Vec<ComponentDescription>,
    /// Topics, those created at run time included.
    pub topics: Vec<TopicDescription>,
    /// Parameters.
    pub parameters: Vec<ParameterDescription>,
    /// Commands.
    pub commands: Vec<CommandInfo>,
    /// Operational states.
    pub states: Vec<&'static str>,
}

/// Kind of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum RunKind {
    /// A run in real time, see [`Builder::start`](crate::Builder::start).
    Live,
    /// A run on virtual time, see [`Builder::simulate`](crate::Builder::simulate).
    Simulation,
    /// A replay of a journal, see [`Builder::replay`](crate::Builder::replay).
    Replay,
}

impl RunKind {
    /// Returns the name in JSON: `live`, `simulation` or `replay`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Live => "live",
            Self::Simulation => "simulation",
            Self::Replay => "replay",
        }
    }
}

/// A link.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LinkDescription {
    /// The joints and links from the root to it: `base/pan/head`.
    pub path: String,
    /// Name.
    pub name: &'static str,
    /// The joint that carries it; `None` for the root.
    pub parent_joint: Option<&'static str>,
    /// Mass, kg, if declared.
    pub mass: Option<f64>,
    /// Shapes that viewers draw.
    pub visuals: &'static [Visual],
}

/// A joint.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct JointDescription {
    /// The links and joints from the root to it: `base/pan`.
    pub path: String,
    /// Name.
    pub name: &'static str,
    /// Kind of motion.
    pub kind: JointKind,
    /// The link that carries it.
    pub parent: &'static str,
    /// The link that it carries.
    pub child: &'static str,
    /// Takes points from its frame, which is the child's at rest, to the parent's.
    pub parent_from_joint: Origin,
    /// Limits.
    pub limit: Option<Limit>,
    /// The joint that it mimics.
    pub mimics: Option<&'static str>,
    /// The paths of the actuators that move it.
    pub actuators: Vec<&'static str>,
}

/// Kind of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ComponentKind {
    /// A sensor.
    Sensor,
    /// An estimator.
    Estimator,
    /// An actuator.
    Actuator,
    /// A controller.
    Controller,
    /// A bridge.
    Bridge,
}

impl ComponentKind {
    /// The word for it in `robot!`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Estimator => "estimator",
            Self::Actuator => "actuator",
            Self::Controller => "controller",
            Self::Bridge => "bridge",
        }
    }
}

/// A component.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ComponentDescription {
    /// Path: `sensor/base/imu`.
    pub path: &'static str,
    /// Kind.
    pub kind: ComponentKind,
    /// The frame of what it publishes: a link or a joint; empty for none.
    pub frame: &'static str,
    /// Period of readings or calls, if the component has a rate.
    pub period: Option<Duration>,
    /// Inputs of an estimator.
    pub inputs: Vec<InputDescription>,
    /// The paths at which it publishes; an actuator, the commands that it has carried out, and its motions.
    pub topics: Vec<&'static str>,
    /// The shape of the commands that an actuator takes.
    pub command: Option<Shape>,
    /// `true` if another component took its place, see [`Builder::replace_sensor`](crate::run::Builder::replace_sensor).
    pub is_replaced: bool,
}

/// An input of an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct InputDescription {
    /// Name.
    pub name: &'static str,
    /// The path of its publisher.
    pub source: &'static str,
    /// `true` if the arrival of a message triggers a dispatch.
    pub is_driver: bool,
    /// `true` if the estimator is called without the input.
    pub is_optional: bool,
}

/// A topic.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TopicDescription {
    /// Path.
    pub path: &'static str,
    /// The name of its payload.
    pub payload: &'static str,
    /// The layouts of its messages: names, hashes and definitions, known before the first message.
    pub layouts: Layouts,
    /// True if callers publish there, see [`Bus::publish_json`](super::Bus::publish_json): an external sensor or input, or a path of a
    /// caller's choice.
    pub is_external: bool,
    /// Period at which messages are published, if that is declared: the rate of a sensor or a service.
    pub period: Option<Duration>,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ParameterDescription {
    /// Path: `param/gains/kp`.
    pub path: &'static str,
    /// Documentation.
    pub doc: &'static str,
    /// Present value, in SI.
    pub value: ParameterValue,
    /// Value as declared, in SI.
    pub default: ParameterValue,
    /// The unit it is declared with; empty for none.
    pub unit: &'static str,
    /// The numbers that it accepts, in SI, if a range is declared.
    pub range: Option<RangeInclusive<f64>>,
    /// The JSON Schema of its value as it is written in a file of settings.
    pub schema: String,
}

/// The element of a list with this path.
macro_rules! by_path {
    ($($(#[$doc:meta])* $name:ident, $list:ident, $type:ty;)*) => { $(
        $(#[$doc])*
        pub fn $name(&self, path: &str) -> Option<&$type> {
            self.$list.iter().find(|element| element.path == path)
        }
    )* };
}

impl Description {
    by_path! {
        /// The component at a path.
        component, components, ComponentDescription;
        /// The topic at a path.
        topic, topics, TopicDescription;
        /// The parameter at a path.
        parameter, parameters, ParameterDescription;
        /// The command at a path.
        command, commands, CommandInfo;
        /// The link at a path: `base/pan/head`.
        link, links, LinkDescription;
        /// The joint at a path: `base/pan`.
        joint, joints, JointDescription;
    }
}
