//! What a robot does beside estimating: states, commands, parameters, safety, and the topics on which they are seen.

mod command;
mod commands;
mod event;
mod execution;
mod parameters;
mod safety;
mod state;
mod system;
mod tasks;

pub use command::{Arm, Command, CommandContext, Disarm, NoArguments, Outcome, Role, Sleep};
pub use commands::{
    Cancel, CategoryDeclaration, CommandDeclaration, CommandStatistics, Prepared, Refusal, RefusalReason,
};
pub use event::{CommandEvent, CommandPhase, ParameterChange, SafetyTransition, StateTransition};
pub use execution::{CommandError, Execution};
pub use parameters::{
    Binding, FromParameter, ParameterDeclaration, ParameterDefault, ParameterError, ParameterType, ParameterValue,
    ParameterValues,
};
pub use safety::{Safety, SafetyError};
pub use system::SystemTopics;
pub(crate) use system::{Control, Declared, Setter};
