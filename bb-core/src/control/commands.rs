//! Commands as declared, and what is known of them at run time.

use super::command::{Command, CommandContext, Outcome, Role};
use super::parameters::{Binding, ParameterValues};
use super::tasks::{Running, Value, lock};
use crate::Payload;
use crate::component::Fault;
use std::any::Any;
use std::fmt;
use std::sync::Mutex;

/// A command as declared.
#[derive(Clone, Copy, Debug)]
pub struct CommandDeclaration {
    /// Its name.
    pub name: &'static str,
    /// Its path: `command/stop`.
    pub path: &'static str,
    /// The states in which it may start; none: as its role has it.
    pub allowed_states: Option<&'static [&'static str]>,
    /// How long it may take.
    pub timeout_nanos: Option<i64>,
    /// The number of its category.
    pub category: usize,
    /// What it cancels when it starts.
    pub cancel: Cancel,
}

/// What a command cancels when it starts.
#[derive(Clone, Copy, Debug)]
pub enum Cancel {
    /// Nothing.
    Nothing,
    /// Whatever runs.
    All,
    /// What runs in these categories.
    Categories(&'static [usize]),
}

impl Cancel {
    pub(super) fn includes(self, category: usize) -> bool {
        match self {
            Self::Nothing => false,
            Self::All => true,
            Self::Categories(categories) => categories.contains(&category),
        }
    }
}

/// A category of commands: how many of them may run at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct CategoryDeclaration {
    /// Its name.
    pub name: &'static str,
    /// How many.
    pub concurrency: usize,
}

impl CommandDeclaration {
    /// Whether it may start in a state; by default, what arms starts `disarmed`, what disarms in every other state, and
    /// the rest when the robot is `idle`.
    pub(super) fn allowed(&self, role: Role, state: &str) -> bool {
        match (self.allowed_states, role) {
            (Some(states), _) => states.contains(&state),
            (None, Role::Plain) => state == super::state::IDLE,
            (None, Role::Arming) => state == super::state::DISARMED,
            (None, Role::Disarming) => state != super::state::DISARMED,
        }
    }
}

/// Why a command was not started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Payload)]
#[non_exhaustive]
pub enum RefusalReason {
    /// Its `allowed_states` do not include this one.
    State,
    /// As many of its category run as may, and it cancels none of them.
    Busy,
    /// The safety state is `error`, or the robot is being disarmed.
    Safety,
    /// The robot stops.
    Stopping,
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
        }
    }
}

impl std::error::Error for Refusal {}

/// What a command has done since the start.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct CommandStatistics {
    /// Its name.
    pub name: &'static str,
    /// How often it was started.
    pub started: u64,
    /// How often it came to its end.
    pub succeeded: u64,
    /// How often it failed.
    pub failed: u64,
    /// How often it took too long.
    pub timed_out: u64,
    /// How often it was cancelled.
    pub cancelled: u64,
    /// How often it was refused.
    pub refused: u64,
    /// Why, the last time.
    pub last_refusal: Option<Refusal>,
}

/// A command with its options, whatever its type.
pub(super) trait AnyCommand: Send + Sync {
    fn role(&self) -> Role;
    /// The parameters that its options are bound to.
    fn bound_to(&self) -> &'static [usize];
    /// `arguments` are its own, or none: the default.
    fn start(
        &self,
        arguments: Option<Box<dyn Any + Send>>,
        parameters: &ParameterValues,
        context: CommandContext,
    ) -> Result<Running, Fault>;
    /// Whether its options would be valid with these parameters.
    fn check(&self, parameters: &ParameterValues) -> Result<(), String>;
}

/// A command as `robot!` lists it.
pub struct Prepared(pub(super) Box<dyn AnyCommand>);

struct OfType<C: Command> {
    /// Options may be sent, and need not be shared.
    options: Mutex<C::Options>,
    binding: Binding<C::Options>,
}

impl Prepared {
    /// The command `C` with its options.
    pub fn new<C: Command>(options: &C::Options, binding: Binding<C::Options>) -> Self {
        Self(Box::new(OfType::<C> { options: Mutex::new(options.clone()), binding }))
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
        arguments: Option<Box<dyn Any + Send>>,
        parameters: &ParameterValues,
        context: CommandContext,
    ) -> Result<Running, Fault> {
        let arguments = match arguments.map(|arguments| arguments.downcast::<C::Arguments>()) {
            None => C::Arguments::default(),
            Some(Ok(arguments)) => *arguments,
            Some(Err(_)) => return Err(Fault::new("these are not its arguments")),
        };
        let options = self.binding.bound(&lock(&self.options), parameters).map_err(Fault::new)?;
        let run = C::run(options, arguments, context);
        Ok(Box::pin(async move {
            let Outcome { value, next_state } = run.await?;
            Ok(Outcome { value: Box::new(value) as Value, next_state })
        }))
    }

    fn check(&self, parameters: &ParameterValues) -> Result<(), String> {
        self.binding.bound(&lock(&self.options), parameters).map(drop)
    }
}

impl fmt::Debug for Prepared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Prepared").field(&self.0.role()).finish()
    }
}
