//! Commands by path, for callers that do not know their types.

use super::Fault;
use crate::declaration::Role;
use crate::message::codec::Shape;
use crate::time::MonotonicTime;
use std::fmt;
use std::time::Duration;

/// A description of a command, for tools.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct CommandInfo {
    /// Path: `command/go`.
    pub path: &'static str,
    /// Effect on the robot's safety.
    pub role: Role,
    /// The shape of its arguments.
    pub arguments: Shape,
    /// The arguments that it gets if none are given, as JSON.
    pub default_arguments: String,
    /// The shape of its result.
    pub output: Shape,
    /// The states in which it may start; `None` means those of its role.
    pub allowed_states: Option<&'static [&'static str]>,
    /// Category.
    pub category: &'static str,
    /// Longest time that an execution may take.
    pub timeout: Option<Duration>,
    /// Number of its executions that have not ended.
    pub running: usize,
}

/// An execution of a command that has not ended.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ExecutionInfo {
    /// Number, as in [`CommandEvent`](crate::event::CommandEvent): [`Bus::cancel`](crate::Bus::cancel) takes it.
    pub number: u64,
    /// The path of its command.
    pub path: &'static str,
    /// The caller that has started it.
    pub caller: String,
    /// The time of its start.
    pub started: MonotonicTime,
}

/// A command that was started by path. Dropping it lets the command run on.
pub struct DynamicExecution(Box<dyn AnyExecution>);

/// An execution whose result is given as JSON.
pub(crate) trait AnyExecution: Send {
    fn number(&self) -> u64;
    fn try_result(&self) -> Option<Result<String, Fault>>;
    fn wait_timeout(&self, timeout: Duration) -> Option<Result<String, Fault>>;
    fn cancel(&self);
}

impl DynamicExecution {
    pub(crate) fn new(execution: impl AnyExecution + 'static) -> Self {
        Self(Box::new(execution))
    }

    /// The number of the execution, as in [`CommandEvent`](crate::event::CommandEvent).
    pub fn number(&self) -> u64 {
        self.0.number()
    }

    /// The result as JSON, if the command has ended and the result has not been taken yet.
    pub fn try_result(&self) -> Option<Result<String, Fault>> {
        self.0.try_result()
    }

    /// Waits for the result as JSON, at most `timeout`; `None` after that.
    pub fn wait_timeout(&self, timeout: Duration) -> Option<Result<String, Fault>> {
        self.0.wait_timeout(timeout)
    }

    /// Cancels the command.
    pub fn cancel(&self) {
        self.0.cancel();
    }
}

impl fmt::Debug for DynamicExecution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DynamicExecution").finish_non_exhaustive()
    }
}
