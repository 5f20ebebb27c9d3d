//! Commands with their options, whatever their types: what differs from command to command is behind one trait, so that the rest of the
//! control state is compiled once.

use super::execution::{RunningFuture, Value};
use crate::component::{Binding, Command, CommandContext, OptionsList, Outcome, Template};
use crate::declaration::{ParameterValues, Role};
use crate::event::Refusal;
use crate::fault::{Fault, caught};
use crate::message::Field;
use crate::message::codec::{Shape, from_json, to_json};
use crate::time::MonotonicTime;
use std::any::Any;
use std::fmt;

/// Counts of a command since the start.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct CommandStatistics {
    /// Name.
    pub name: &'static str,
    /// Executions started.
    pub started: u64,
    /// Executions that succeeded.
    pub succeeded: u64,
    /// Executions that failed.
    pub failed: u64,
    /// Executions that took longer than the `timeout`.
    pub timed_out: u64,
    /// Executions cancelled.
    pub cancelled: u64,
    /// Requests refused.
    pub refused: u64,
    /// The reason of the last refusal.
    pub last_refusal: Option<Refusal>,
    /// The time of the last refusal, unless the command has been started since.
    pub refused_at: Option<MonotonicTime>,
}

/// The arguments of a command, of its own type.
pub(crate) type Arguments = Box<dyn Any + Send>;

/// A command with its options, whatever its type.
pub(super) trait AnyCommand: Send + Sync {
    fn role(&self) -> Role;
    /// The parameters that its options are bound to.
    fn bound_to(&self) -> &'static [usize];
    /// `arguments` are of its own type; `None` means the default. User code runs here.
    fn start(
        &self,
        arguments: Option<Arguments>,
        parameters: &ParameterValues,
        context: CommandContext,
    ) -> Result<RunningFuture, Fault>;
    /// Checks that the command's options would be valid with these parameters. User code runs here.
    fn check(&self, parameters: &ParameterValues) -> Result<(), String>;
    /// The schemas of its arguments and its result.
    fn shapes(&self) -> (Shape, Shape);
    /// The default of its arguments as JSON. User code runs here.
    fn default_arguments(&self) -> String;
    /// Reads the command's arguments from JSON; the default ones from empty text.
    fn arguments(&self, json: &str) -> Result<Arguments, Fault>;
    /// Returns the command's result as JSON.
    fn result_json(&self, result: Value) -> Result<String, Fault>;
}

/// A command as listed by `robot!`.
pub struct Prepared(pub(super) Box<dyn AnyCommand>);

struct OfType<C: Command> {
    /// An error if they cannot be copied.
    options: Result<Template<C::Options>, String>,
    binding: Binding<C::Options>,
}

impl Prepared {
    /// The command `C` with its options, those of the component with that number.
    pub fn new<C: Command>(options: &OptionsList, component: usize, binding: Binding<C::Options>) -> Self {
        let options = Template::new(options.of::<C::Options>(component)).map_err(|fault| fault.to_string());
        Self(Box::new(OfType::<C> { options, binding }))
    }
}

impl<C: Command> OfType<C> {
    fn bound(&self, parameters: &ParameterValues) -> Result<C::Options, String> {
        let options = self.options.as_ref().map_err(String::clone)?;
        options.bound(&self.binding, parameters)
    }
}

impl<C: Command> AnyCommand for OfType<C> {
    fn role(&self) -> Role {
        C::ROLE
    }

    fn bound_to(&self) -> &'static [usize] {
        self.binding.parameters
    }

    fn start(
        &self,
        arguments: Option<Arguments>,
        parameters: &ParameterValues,
        context: CommandContext,
    ) -> Result<RunningFuture, Fault> {
        let arguments = match arguments.map(|arguments| arguments.downcast::<C::Arguments>()) {
            None => C::Arguments::default(),
            Some(Ok(arguments)) => *arguments,
            Some(Err(_)) => return Err(Fault::new("these are not its arguments")),
        };
        let options = self.bound(parameters).map_err(Fault::new)?;
        let run = C::run(options, arguments, context);
        Ok(Box::pin(async move {
            let Outcome { value, next_state } = run.await?;
            Ok(Outcome { value: Box::new(value) as Value, next_state })
        }))
    }

    fn check(&self, parameters: &ParameterValues) -> Result<(), String> {
        self.bound(parameters).map(drop)
    }

    fn shapes(&self) -> (Shape, Shape) {
        (C::Arguments::SHAPE, C::Output::SHAPE)
    }

    fn default_arguments(&self) -> String {
        // One that panics has none to show.
        caught(|| Ok(to_json(&C::Arguments::default()))).unwrap_or_default()
    }

    fn arguments(&self, json: &str) -> Result<Arguments, Fault> {
        if json.trim().is_empty() {
            return Ok(Box::new(C::Arguments::default()));
        }
        Ok(Box::new(from_json::<C::Arguments>(json)?))
    }

    fn result_json(&self, result: Value) -> Result<String, Fault> {
        let result = result.downcast::<C::Output>().map_err(|_| Fault::new("its result has another type"))?;
        Ok(to_json(&*result))
    }
}

impl fmt::Debug for Prepared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Prepared").field(&self.0.role()).finish()
    }
}
