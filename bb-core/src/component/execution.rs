//! Commands by path, for callers that do not know their types.

use super::Fault;
use crate::message::codec::Shape;
use std::fmt;
use std::time::Duration;

/// A description of a command, for tools.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct CommandInfo {
    /// Its path: `command/go`.
    pub path: &'static str,
    /// The shape of its arguments.
    pub arguments: Shape,
    /// The shape of its result.
    pub output: Shape,
    /// The states in which it may start; `None` means those of its role.
    pub allowed_states: Option<&'static [&'static str]>,
    /// Its category.
    pub category: &'static str,
    /// How long it may take.
    pub timeout: Option<Duration>,
    /// Number of its executions that have not ended.
    pub running: usize,
}

/// A command that was started by path. Dropping it lets the command run on.
pub struct DynamicExecution(Box<dyn AnyExecution>);

/// An execution whose result is given as JSON.
pub(crate) trait AnyExecution: Send {
    fn try_result(&self) -> Option<Result<String, Fault>>;
    fn wait_timeout(&self, timeout: Duration) -> Option<Result<String, Fault>>;
    fn cancel(&self);
}

impl DynamicExecution {
    pub(crate) fn new(execution: impl AnyExecution + 'static) -> Self {
        Self(Box::new(execution))
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
