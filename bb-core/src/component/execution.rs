//! Commands by path, for callers that do not know their types.

use super::Fault;
use crate::declaration::Role;
use crate::message::codec::{FieldShape, Schema, Shape, json_schema};
use crate::time::MonotonicTime;
use bb_message::__private::member_of;
use std::fmt;
use std::future::Future;
use std::ops::RangeInclusive;
use std::pin::Pin;
use std::task::{Context, Poll};
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

/// One argument of a command, for forms and tables.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ArgumentInfo {
    /// Name.
    pub name: &'static str,
    /// Shape.
    pub shape: Shape,
    /// Doc comment; empty for none.
    pub doc: &'static str,
    /// The symbol of its unit, if it has one: `m/s`.
    pub unit: Option<&'static str>,
    /// The numbers that it may be, in that unit.
    pub range: Option<RangeInclusive<f64>>,
    /// Default, as JSON.
    pub default: Option<String>,
}

impl CommandInfo {
    /// Lists the arguments, if they are the fields of a struct.
    pub fn argument_list(&self) -> Vec<ArgumentInfo> {
        let Shape::Struct(of) = self.arguments else { return Vec::new() };
        let describe = |field: &'static FieldShape| ArgumentInfo {
            name: field.name,
            shape: field.shape,
            doc: field.doc,
            unit: if let [unit] = field.units { Some(unit.symbol) } else { None },
            range: field.range.map(|range| range.minimum()..=range.maximum()),
            default: member_of(&self.default_arguments, field.name),
        };
        of.fields.iter().filter(|field| field.is_named()).map(describe).collect()
    }

    /// The shape of its arguments; `None` if there are no values to give.
    pub fn argument_shape(&self) -> Option<Shape> {
        match self.arguments {
            Shape::Struct(_) if self.argument_list().is_empty() => None,
            shape => Some(shape),
        }
    }

    /// The definition of its arguments as a message of ROS, and those of all types it refers to; `None` as for [`Self::argument_shape`].
    pub fn argument_definition(&self) -> Option<String> {
        // The name is in no definition; this one is no payload's.
        self.argument_shape().map(|shape| Schema::new("bb_msgs/srv/Arguments_Request", shape).text)
    }

    /// The JSON Schema of its arguments, with those that it gets if none are given as the `default`.
    pub fn argument_schema(&self) -> String {
        let schema = json_schema(self.arguments);
        match schema.strip_suffix('}') {
            Some(open) if !self.default_arguments.is_empty() => {
                format!("{open},\"default\":{}}}", self.default_arguments)
            }
            _ => schema,
        }
    }
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
    /// Last value given to [`CommandContext::progress`](crate::CommandContext::progress), as JSON.
    pub progress: Option<String>,
}

/// A command that was started by path. Dropping it lets the command run on.
pub struct DynamicExecution(Box<dyn AnyExecution>);

/// An execution whose result is given as JSON.
pub(crate) trait AnyExecution: Send {
    fn number(&self) -> u64;
    fn try_result(&self) -> Option<Result<String, Fault>>;
    fn wait_timeout(&self, timeout: Duration) -> Option<Result<String, Fault>>;
    fn cancel(&self);
    fn poll(&mut self, context: &mut Context<'_>) -> Poll<Result<String, Fault>>;
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

/// Awaits the result as JSON, on any executor.
impl Future for DynamicExecution {
    type Output = Result<String, Fault>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        self.0.poll(context)
    }
}

impl fmt::Debug for DynamicExecution {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DynamicExecution").finish_non_exhaustive()
    }
}
