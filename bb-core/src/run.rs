//! A robot that runs: assembled by a [`Builder`], driven by real sensors in threads ([`Running`]), on virtual time by its
//! caller ([`Simulation`]), or from a journal ([`Replay`]).

mod actuator;
mod builder;
mod describe;
mod error;
mod handle;
mod host;
mod live;
mod machine;
mod occupied;
mod replay;
mod report;
mod robot;
mod running;
mod settings;
mod simulation;
mod source;
mod threads;
mod timekeeper;
mod visit;

pub use crate::component::{ActuatorError, ActuatorLink, Bus};
pub use crate::declaration::{ActuatorDeclaration, SensorDeclaration, Supervisor};
pub use crate::event::ComponentFault;
pub use crate::lifecycle::Supervision;
pub use actuator::{ActuatorNode, AnyActuator};
pub use builder::Builder;
pub use error::StartError;
pub use handle::{
    ActuatorHandle, BridgeHandle, CommandHandle, Configurable, ControllerHandle, EstimatorHandle,
    EstimatorOfSeveralHandle, Faults, Health, JournalLines, OutputHandle, ParameterHandle, Publisher, SafetyErrors,
    SafetyState, SensorHandle, StateMachine,
};
pub use live::Live;
pub use replay::{Replay, ReplayError};
pub use report::Report;
pub use robot::{IslandOf, Robot};
pub use running::Running;
pub use settings::{SettingProblem, SettingsError, SettingsList};
pub use simulation::Simulation;
pub use source::{Assembly, Source, SourceStatistics};
pub use visit::{Visit, Visitable, visit};
