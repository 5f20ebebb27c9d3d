//! The contract of a command.

use super::system::{Control, Setter};
use super::tasks::{Alarm, Sleeper};
use super::{ParameterError, ParameterValue};
use crate::component::{Fault, NoOptions, Options};
use crate::node::HealthTransition;
use crate::run::Bus;
use crate::time::MonotonicTime;
use std::future::Future;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

/// A short task that a robot is told to do: arm, stop, move somewhere.
///
/// It is an `async` function on the robot's own clock: [`CommandContext::sleep`] takes virtual time on a robot that is
/// simulated. It may await anything else too. A command is cancelled by dropping its future, so what must be undone
/// belongs in a `Drop`.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Waits until the robot stands, then declares it degraded.
/// #[derive(Debug)]
/// pub struct SlowDown;
///
/// impl Command for SlowDown {
///     type Options = NoOptions;
///     type Arguments = NoArguments;
///     type Output = ();
///
///     async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
///         context.sleep(Duration::from_millis(200)).await;
///         Ok(Outcome::done(()).next_state("degraded"))
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a command",
    label = "cannot be declared in `commands`",
    note = "implement `bb_core::Command` for it"
)]
pub trait Command: Sized + Send + 'static {
    /// What `Name(…)` in `robot!` fills.
    type Options: Options;
    /// What its caller gives. One that a change of health starts gets the default.
    type Arguments: Default + Send + 'static;
    /// What it gives back.
    type Output: Send + 'static;

    /// Whether it arms or disarms the robot.
    const ROLE: Role = Role::Plain;

    /// Runs it.
    ///
    /// # Errors
    /// Why it has failed; reported to the caller and on its topic.
    fn run(
        options: Self::Options,
        arguments: Self::Arguments,
        context: CommandContext,
    ) -> impl Future<Output = Result<Outcome<Self::Output>, Fault>> + Send;
}

/// What a command does to the robot's safety when it succeeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Role {
    /// Nothing.
    #[default]
    Plain,
    /// The robot is armed.
    Arming,
    /// The robot is disarmed: all other commands are cancelled, and whoever owns hardware makes it safe.
    Disarming,
}

/// For commands without arguments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoArguments;

/// How a command has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub struct Outcome<T> {
    pub(super) value: T,
    pub(super) next_state: Option<&'static str>,
}

impl<T> Outcome<T> {
    /// With that value; the robot goes back to the state it was in.
    pub fn done(value: T) -> Self {
        Self { value, next_state: None }
    }

    /// Names the state that follows: `idle` or a declared one. Another name fails the command.
    pub fn next_state(mut self, state: &'static str) -> Self {
        self.next_state = Some(state);
        self
    }

    /// The value.
    pub fn value(&self) -> &T {
        &self.value
    }
}

/// What a running command is told, and what it may do.
#[derive(Clone, Debug)]
pub struct CommandContext {
    pub(super) name: &'static str,
    pub(super) health: Option<HealthTransition>,
    pub(super) control: Control,
}

impl CommandContext {
    /// The name it was declared under.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The change of health that started it, if one did: estimator, reason, source, previous and new state.
    pub fn health(&self) -> Option<&HealthTransition> {
        self.health.as_ref()
    }

    /// The time now: when the robot's commands have gone on, the same for all of them.
    pub fn now(&self) -> MonotonicTime {
        self.control.moment()
    }

    /// Waits on the robot's clock.
    pub fn sleep(&self, duration: Duration) -> Sleep {
        let until = self.now() + duration;
        Sleep { until, control: self.control.clone(), sleeper: self.control.sleeper(), alarm: None }
    }

    /// The operational state.
    pub fn state(&self) -> &'static str {
        self.control.state()
    }

    /// Topics and actuators, by path.
    pub fn bus(&self) -> Bus {
        Bus::new(self.control.clone())
    }

    /// The value of the parameter at `path`: `param/imu/beta`.
    pub fn parameter(&self, path: &str) -> Option<ParameterValue> {
        self.control.parameter_at(path)
    }

    /// Sets the parameter at `path`.
    ///
    /// # Errors
    /// What was expected.
    pub fn set_parameter(&self, path: &str, value: impl Into<ParameterValue>) -> Result<(), ParameterError> {
        self.control.set_parameter_at(path, value.into(), Setter::Command)
    }
}

/// The future of [`CommandContext::sleep`].
#[derive(Debug)]
pub struct Sleep {
    until: MonotonicTime,
    control: Control,
    sleeper: Sleeper,
    alarm: Option<Alarm>,
}

impl Future for Sleep {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        if self.control.moment() >= self.until {
            return Poll::Ready(());
        }
        self.alarm = Some(self.sleeper.wake_at(self.until, self.alarm, context.waker().clone()));
        Poll::Pending
    }
}

impl Drop for Sleep {
    fn drop(&mut self) {
        if let Some(alarm) = self.alarm {
            self.sleeper.forget(alarm);
        }
    }
}

/// Arms the robot.
#[derive(Debug)]
pub struct Arm;

impl Command for Arm {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();
    const ROLE: Role = Role::Arming;

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        Ok(Outcome::done(()))
    }
}

/// Disarms the robot.
#[derive(Debug)]
pub struct Disarm;

impl Command for Disarm {
    type Options = NoOptions;
    type Arguments = NoArguments;
    type Output = ();
    const ROLE: Role = Role::Disarming;

    async fn run(_: NoOptions, _: NoArguments, _: CommandContext) -> Result<Outcome<()>, Fault> {
        Ok(Outcome::done(()))
    }
}
