//! A robot that runs: assembled by a [`Builder`], driven by real sensors in threads ([`Running`]) or on virtual time
//! by whoever calls it ([`Simulation`]).

mod actuator;
mod agenda;
mod builder;
mod bus;
mod error;
mod handle;
mod live;
mod machine;
mod periodic;
mod replay;
mod report;
mod robot;
mod running;
mod simulation;
mod source;
mod startup;
mod stop;
mod supervision;
mod threads;

pub use actuator::{ActuatorDeclaration, ActuatorError, ActuatorNode, AnyActuator};
pub use builder::Builder;
pub(crate) use bus::Directory;
pub use bus::{ActuatorLink, Bus};
pub use error::{ComponentFault, StartError};
pub(crate) use error::{Failed, caught, retire, wake};
pub use handle::{
    ActuatorHandle, BridgeHandle, CommandHandle, Configurable, ControllerHandle, EstimatorHandle,
    EstimatorOfSeveralHandle, Health, JournalLines, OutputHandle, ParameterHandle, Publisher, SafetyErrors,
    SafetyState, SensorHandle, StateMachine, Visit, Visitable,
};
pub use live::Live;
pub use periodic::{AsBridge, AsController, AsSensor, Periodic};
pub use replay::{Replay, ReplayError};
pub use report::Report;
pub use robot::{FeedOf, IslandOf, Robot};
pub use running::Running;
pub use simulation::Simulation;
pub use source::{SensorDeclaration, Source};
pub use startup::Startup;
pub use stop::StopSignal;
pub(crate) use supervision::Failures;
pub use supervision::{Supervision, Supervisor};
