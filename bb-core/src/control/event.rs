//! What is published on the system topics.

use super::{ParameterValue, Refusal, Safety};
use crate::Payload;
use crate::node::HealthTransition;

/// A change of the operational state, at `state_machine`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct StateTransition {
    /// What it was.
    pub from: &'static str,
    /// What it is.
    pub to: &'static str,
    /// The command behind it, if one is.
    pub command: Option<&'static str>,
}

/// A change of the safety state, at `safety`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct SafetyTransition {
    /// What it was.
    pub from: Safety,
    /// What it is.
    pub to: Safety,
}

/// A parameter that has changed, at its path: `param/imu/beta`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct ParameterChange {
    /// Its path.
    pub path: &'static str,
    /// What it was.
    pub from: ParameterValue,
    /// What it is.
    pub to: ParameterValue,
}

/// What becomes of a command, at its path: `command/stop`.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct CommandEvent {
    /// Its name.
    pub command: &'static str,
    /// The number of this execution; 0 if it was refused.
    pub execution: u64,
    /// What happened.
    pub phase: CommandPhase,
    /// The change of health that started it, if one did.
    pub health: Option<HealthTransition>,
}

/// See [`CommandEvent`].
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
#[non_exhaustive]
pub enum CommandPhase {
    /// It runs.
    Started,
    /// It has come to its end.
    Succeeded,
    /// It has failed, and why.
    Failed(String),
    /// It took longer than its `timeout`.
    TimedOut,
    /// It was cancelled: by its caller, by another command, or since the robot was disarmed or stopped.
    Cancelled,
    /// It was not started, and why.
    Refused(Refusal),
}
