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
    /// Name of the command.
    pub command: &'static str,
    /// The number of this execution; 0 if it was refused.
    pub execution: u64,
    /// Event in the life of the execution.
    pub phase: CommandPhase,
    /// Caller: the path of a component or a command, `program`, or a name from
    /// [`Bus::for_caller`](crate::Bus::for_caller).
    pub caller: String,
    /// The health transition that started it, if one did.
    pub health: Option<HealthTransition>,
}

/// Phase of an execution, see [`CommandEvent`].
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
#[non_exhaustive]
pub enum CommandPhase {
    /// The command runs.
    Started,
    /// The command has succeeded.
    Succeeded,
    /// The command has failed, for this reason.
    Failed(String),
    /// The command took longer than its `timeout`.
    TimedOut,
    /// The command was cancelled: by its caller, by another command, or because the robot was disarmed or stopped.
    Cancelled,
    /// The command was not started, for this reason.
    Refused(Refusal),
}

/// A category of commands: how many of them may run at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct CategoryDeclaration {
    /// Name.
    pub name: &'static str,
    /// Number of commands of the category that may run at once.
    pub concurrency: usize,
}

/// Reason for which a command was not started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
#[non_exhaustive]
pub enum RefusalReason {
    /// The command's `allowed_states` do not include the current state.
    State,
    /// The command's category is full, and it cancels none of the running commands.
    Busy,
    /// The safety state is `error`, or the robot is being disarmed.
    Safety,
    /// The robot is stopping.
    Stopping,
    /// Too many cancelled executions have not returned from their code: 256, or 512 for commands that health starts. Commands that disarm always start.
    Hanging,
}

/// A command that was not started.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct Refusal {
    /// Name of the command.
    pub command: &'static str,
    /// Reason for the refusal.
    pub reason: RefusalReason,
    /// The operational state it was refused in.
    pub state: &'static str,
    /// Category of the command.
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
