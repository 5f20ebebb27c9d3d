//! A running robot: assembled by a [`Builder`], driven by real sensors in threads ([`Running`]), on virtual time by
//! its caller ([`Simulation`]), or from a journal ([`Replay`]).

pub(crate) mod actuator;
mod bound;
mod builder;
mod describe;
mod discovery;
mod draft;
mod ending;
mod error;
mod handle;
mod host;
mod joints;
mod keeper;
mod live;
mod machine;
mod occupied;
mod replacing;
mod replay;
mod report;
mod running;
mod settings;
#[cfg(feature = "signals")]
mod signals;
mod simulation;
pub(crate) mod source;
mod threads;
mod timekeeper;
mod visit;
mod wired;

pub use crate::component::{ActuatorError, ActuatorLink, Bus};
pub use crate::control::{CommandError, CommandStatistics, Execution, ReportedFault, ReportedSafetyError};
pub use crate::event::ComponentFault;
pub use crate::lifecycle::Supervision;
pub use crate::node::{DropReason, EstimatorStatistics, InputStatistics, LatencyStatistics};
pub use crate::pubsub::{SubscriberStatistics, TopicStatistics};
pub use actuator::ActuatorStatistics;
pub(crate) use actuator::{ActuatorNode, AnyActuator};
pub use builder::Builder;
pub use error::StartError;
pub use handle::{
    ActuatorHandle, BridgeHandle, CommandHandle, Configurable, ControllerHandle, EstimatorHandle,
    EstimatorOfSeveralHandle, Faults, Health, JournalLines, OutputHandle, ParameterHandle, Publisher, SafetyErrors,
    SafetyState, SensorHandle, StateMachine,
};
pub use live::Live;
pub use replay::{Replay, ReplayError};
pub use report::{Panics, Problem, Report, Severity};
pub use running::Running;
pub use settings::{SettingProblem, SettingsError, SettingsList};
pub use simulation::Simulation;
pub use source::SourceStatistics;
pub(crate) use source::{Assembly, Sources};
pub use visit::Visitable;

use crate::component::OptionsList;
use crate::control::Prepared;
use crate::declaration::{
    ActuatorDeclaration, CommandDeclaration, EstimatorDeclaration, ParameterDeclaration, SensorDeclaration, graph,
};
use crate::event::CategoryDeclaration;
use crate::node::IslandOf;
use crate::pubsub::AnyTopic;
use crate::topology::{GraphFormat, Topology};
use builder::MadeByNew;
use settings::settings_schema;
use std::sync::Arc;
use wired::declaration;

/// A declared robot. `robot!` implements it for the type that it defines; users call [`Robot::builder`].
pub trait Robot: Sized + Send + Sync + 'static {
    /// Name.
    const NAME: &'static str;
    /// Links and joints.
    const TOPOLOGY: &'static Topology;
    /// Sensors, in the order of their declaration.
    const SENSORS: &'static [SensorDeclaration];
    /// Estimators, in the order of their declaration.
    const ESTIMATORS: &'static [EstimatorDeclaration];
    /// Actuators, in the order of their declaration.
    const ACTUATORS: &'static [ActuatorDeclaration];
    /// Controllers and bridges, in the order of their declaration.
    const SERVICES: &'static [SensorDeclaration];
    /// Declared states, without the built-in ones.
    const STATES: &'static [&'static str];
    /// The categories of its commands.
    const CATEGORIES: &'static [CategoryDeclaration];
    /// Commands, in the order of their declaration.
    const COMMANDS: &'static [CommandDeclaration];
    /// Parameters, in the order of their declaration.
    const PARAMETERS: &'static [ParameterDeclaration];
    /// Places of the islands in the wiring.
    #[doc(hidden)]
    const ISLANDS: &'static [IslandOf<Self::Wiring>];
    /// The options bound to a parameter: the number of the component in [`Robot::options`], the option's name, and
    /// the number of the parameter.
    #[doc(hidden)]
    const BOUND_OPTIONS: &'static [(usize, &'static str, usize)];

    /// The topics of all publishers.
    #[doc(hidden)]
    type Topics: Send + Sync;
    /// The topics and the running estimators.
    #[doc(hidden)]
    type Wiring: Send + Sync + 'static;

    /// The options as declared.
    #[doc(hidden)]
    fn options() -> OptionsList;
    #[doc(hidden)]
    fn topics() -> Self::Topics;
    /// Starts all estimators; errors are stored in `assembly`.
    #[doc(hidden)]
    fn wire(topics: Self::Topics, options: &OptionsList, assembly: &Assembly) -> Self::Wiring;
    /// Returns the sensors and services.
    #[doc(hidden)]
    fn sources(wiring: &Arc<Self::Wiring>) -> Sources;
    #[doc(hidden)]
    fn wired_topics(wiring: &Self::Wiring) -> &Self::Topics;
    /// The topic of that publisher; `None` beyond the last.
    #[doc(hidden)]
    fn topic(topics: &Self::Topics, publisher: usize) -> Option<&dyn AnyTopic>;
    /// The actuator of that number; `None` beyond the last.
    #[doc(hidden)]
    fn actuator(wiring: &Self::Wiring, actuator: usize) -> Option<&dyn AnyActuator>;
    /// The commands with their options.
    #[doc(hidden)]
    fn commands(options: &OptionsList) -> Vec<Prepared>;

    /// Returns the links and joints as a URDF file.
    fn to_urdf() -> String {
        Self::TOPOLOGY.to_urdf(Self::NAME)
    }

    /// The robot as a picture, in Mermaid or DOT: links and joints; the dataflow from sensors through estimators; actuators with
    /// the joints that they move; controllers and bridges; commands, and the estimators whose health starts them.
    /// [`Bus::graph`] marks the components that were replaced in a run.
    fn graph(format: GraphFormat) -> String {
        graph(format, declaration::<Self>(), &|_| false)
    }

    /// The JSON Schema (draft 2020-12) of its settings, see [`Builder::set`]: options and parameters in nested objects, as a
    /// TOML file of them is nested.
    fn settings_schema() -> String {
        settings_schema(declaration::<Self>(), Self::options())
    }

    /// Makes rustc explain how a robot is assembled where `new` is called.
    #[doc(hidden)]
    fn new() -> Builder<Self>
    where
        Self: MadeByNew,
    {
        Self::builder()
    }

    /// Assembles the robot: options may be changed and topics subscribed to before it starts.
    fn builder() -> Builder<Self> {
        Builder::new()
    }
}
