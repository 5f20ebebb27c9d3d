//! Events of commands and of the operational state.

use super::HealthTransition;
use crate::message::Payload;
use std::fmt;

/// A change of the operational state, published at `state_machine`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct StateTransition {
    /// The previous state.
    pub from: &'static str,
    /// The new state.
    pub to: &'static str,
    /// The command that caused it, if one did.
    pub command: Option<&'static str>,
}

/// An event of a command, published at its path: `command/stop`.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct CommandEvent {
    /// Its name.
    pub command: &'static str,
    /// The number of this execution; 0 if it was refused.
    pub execution: u64,
    /// What happened.
    pub phase: CommandPhase,
    /// Caller: the path of a component or a command, `program`, or a name from
    /// [`Bus::for_caller`](crate::Bus::for_caller).
    pub caller: String,
    /// The health transition that started it, if one did.
    pub health: Option<HealthTransition>,
}

/// See [`CommandEvent`].
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
#[non_exhaustive]
pub enum CommandPhase {
    /// It runs.
    Started,
    /// It has succeeded.
    Succeeded,
    /// It has failed, and why.
    Failed(String),
    /// It took longer than its `timeout`.
    TimedOut,
    /// It was cancelled: by its caller, by another command, or because the robot was disarmed or stopped.
    Cancelled,
    /// It was not started, and why.
    Refused(Refusal),
}

/// A category of commands: how many of them may run at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct CategoryDeclaration {
    /// Its name.
    pub name: &'static str,
    /// How many.
    pub concurrency: usize,
}

/// Why a command was not started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
#[non_exhaustive]
pub enum RefusalReason {
    /// Its `allowed_states` do not include the current state.
    State,
    /// Its category is full, and it cancels none of the running commands.
    Busy,
    /// The safety state is `error`, or the robot is being disarmed.
    Safety,
    /// The robot is stopping.
    Stopping,
    /// Too many cancelled executions have not returned from their code.
    Hanging,
}

/// A command that was not started.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct Refusal {
    /// Its name.
    pub command: &'static str,
    /// Why.
    pub reason: RefusalReason,
    /// The operational state it was refused in.
    pub state: &'static str,
    /// Its category.
    pub category: CategoryDeclaration,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { command, reason, state, category } = self;
        write!(f, "`{command}` is refused: ")?;
        match reason {
            RefusalReason::State => write!(f, "it is not allowed in the state `{state}`"),
            RefusalReason::Busy => {
                let CategoryDeclaration { name, concurrency } = category;
                write!(f, "{concurrency} of the category `{name}` run already, and no more may")
            }
            RefusalReason::Safety => write!(f, "the robot is not safe, or is being disarmed"),
            RefusalReason::Stopping => write!(f, "the robot stops"),
            RefusalReason::Hanging => {
                write!(f, "too many commands that were cancelled have not returned from their code")
            }
        }
    }
}

impl std::error::Error for Refusal {}
