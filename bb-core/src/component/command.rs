//! The contract of a command.

use super::host::Controls;
use super::{Bus, Fault, NoOptions, Options};
use crate::declaration::Role;
use crate::event::{HardwareError, HealthTransition};
use crate::message::{Field, Payload, Stamped};
use crate::pubsub::DynamicMessage;
use crate::schedule::{Alarm, Sleeper};
use crate::time::MonotonicTime;
use std::future::Future;
use std::ops::Deref;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

/// A short task of a robot: arm, stop, move to a place.
///
/// It is an `async` function on the robot's own clock: in a simulation, [`CommandContext::sleep`] takes virtual time.
/// It may await anything else too. A command is cancelled by dropping its future, so put cleanup in a `Drop`. From
/// the moment it is cancelled, anything it has obtained through its context refuses to act, even if its code blocks
/// and has not noticed yet.
///
/// To a journal, commands are part of the outside world: it holds their effects and how they ended, and a replay does
/// not run them.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Waits until the robot has come to rest, then declares it degraded.
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
    /// Options of the command: the struct that `Name(…)` in `robot!` fills.
    type Options: Options;
    /// The arguments its caller gives. Derive [`Payload`] for the type, so that tools can start the command with
    /// arguments from JSON. A command started by a health transition gets the default.
    type Arguments: Field + Default + Send + 'static;
    /// Result of the command.
    type Output: Field + Send + 'static;

    /// Effect of the command on the robot's safety: whether it arms or disarms the robot.
    const ROLE: Role = Role::Plain;

    /// Runs it.
    ///
    /// # Errors
    /// Any error: it is reported to the caller and on the command's topic.
    fn run(
        options: Self::Options,
        arguments: Self::Arguments,
        context: CommandContext,
    ) -> impl Future<Output = Result<Outcome<Self::Output>, Fault>> + Send;
}

/// The arguments of a command without arguments.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct NoArguments;

/// The value of a command that succeeded, and the state that it names next, if any.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub struct Outcome<T> {
    pub(crate) value: T,
    pub(crate) next_state: Option<&'static str>,
}

impl<T> Outcome<T> {
    /// Ends with that value; the operational state stays as it is.
    pub fn done(value: T) -> Self {
        Self { value, next_state: None }
    }

    /// Names the state that follows: `idle` or a declared one. Another name fails the command. To change the state before the end, use
    /// [`CommandContext::transition`].
    pub fn next_state(mut self, state: &'static str) -> Self {
        self.next_state = Some(state);
        self
    }

    /// The value.
    pub fn value(&self) -> &T {
        &self.value
    }
}

/// The context of a running command, through which it reaches the robot: it dereferences to its [`Bus`], which refuses to act once the
/// command has ended or was cancelled.
#[derive(Clone, Debug)]
pub struct CommandContext {
    pub(crate) name: &'static str,
    pub(crate) health: Option<HealthTransition>,
    pub(crate) bus: Bus,
    pub(crate) sleeper: Sleeper,
    pub(crate) path: &'static str,
    /// The number of the execution.
    pub(crate) execution: u64,
}

impl CommandContext {
    /// The name it was declared under.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The health transition that started it, if one did: estimator, reason, source, previous and new state.
    pub fn health(&self) -> Option<&HealthTransition> {
        self.health.as_ref()
    }

    /// The time now.
    pub fn now(&self) -> MonotonicTime {
        self.bus.clock().now()
    }

    /// Waits on the robot's clock.
    pub fn sleep(&self, duration: Duration) -> Sleep {
        Sleep { until: self.now() + duration, bus: self.bus.clone(), sleeper: self.sleeper.clone(), alarm: None }
    }

    /// Publishes how far it has come at `command/<name>/progress`, where subscriptions to `command` or to everything receive it. A command
    /// publishes one type there. Those who come late find the last one in [`Bus::executions`].
    ///
    /// ```
    /// use bb_core::prelude::*;
    ///
    /// /// How much of a map has been seen.
    /// #[derive(Clone, Debug, Payload)]
    /// struct Seen {
    ///     /// From 0 to 1.
    ///     share: f64,
    /// }
    ///
    /// struct Explore;
    ///
    /// impl Command for Explore {
    ///     type Options = NoOptions;
    ///     type Arguments = NoArguments;
    ///     type Output = ();
    ///
    ///     async fn run(_: NoOptions, _: NoArguments, context: CommandContext) -> Result<Outcome<()>, Fault> {
    ///         for part in 1..=4 {
    ///             context.sleep(Duration::from_millis(250)).await;
    ///             context.progress(Seen { share: f64::from(part) / 4.0 })?;
    ///         }
    ///         Ok(Outcome::done(()))
    ///     }
    /// }
    ///
    /// robot! { robot Scout; commands { arm: Arm; explore: Explore; } link base; }
    ///
    /// fn main() -> Result<(), Box<dyn std::error::Error>> {
    ///     let mut simulation = Scout::builder().simulate()?;
    ///     let progress = simulation.subscribe_any(Select::Path("command/explore/progress"), None, Overflow::default());
    ///     simulation.arm()?;
    ///     simulation.command(scout::command::explore, NoArguments)?;
    ///     simulation.run_for(Duration::from_secs(1));
    ///     let shares = progress.drain().filter_map(|message| message.downcast::<Seen>().map(|seen| seen.share));
    ///     assert_eq!(shares.collect::<Vec<_>>(), [0.25, 0.5, 0.75, 1.0]);
    ///     Ok(())
    /// }
    /// ```
    ///
    /// # Errors
    /// It has published another type there before, or it was cancelled.
    pub fn progress<T: Payload>(&self, progress: T) -> Result<(), Fault> {
        let publisher = self.bus.publisher::<T>(&format!("{}/progress", self.path))?;
        let kept = DynamicMessage::of(publisher.path(), Stamped::new(self.now(), progress.clone()));
        if let Ok(_permit) = self.bus.caller.permit() {
            self.controls().keep_progress(self.execution, kept);
        }
        publisher.publish(progress);
        Ok(())
    }

    /// Returns whether the command was cancelled or has timed out. Anything it sends from then on is refused. A command that blocks its
    /// thread should check this from time to time.
    pub fn is_cancelled(&self) -> bool {
        !self.bus.caller.is_valid()
    }

    /// Changes the operational state while the command runs, to `idle` or a declared state: a phase of its work, in which other
    /// commands are allowed or not. Commands that start from now on see the new state.
    ///
    /// The state stays until something else changes it, whether the command succeeds, fails, times out or is cancelled: only its code
    /// knows what it has done to the robot. [`Outcome::next_state`] names another one at the end. Disarming leaves it.
    ///
    /// # Errors
    /// No such state is declared, the robot is not armed, or the command was cancelled or has timed out.
    pub fn transition(&self, state: &str) -> Result<(), Fault> {
        self.controls().transition(self.execution, state, &self.bus.caller)
    }

    /// Registers a callback that makes hardware safe when the robot is disarmed while this command runs. It is
    /// removed when the command's code has returned. All callbacks run concurrently, each on its own thread, and
    /// must return within 5 s. One that fails or takes longer leads to the safety state `error`.
    pub fn on_disarm(&self, hook: impl Fn() -> Result<(), Fault> + Send + Sync + 'static) {
        self.controls().on_disarm(self.path, Some(self.execution), Arc::new(hook));
    }

    /// Reports that hardware is in a dangerous state: the robot is disarmed, its safety state becomes `error`, and the error
    /// is published at `safety/error`. Give a text, or a [`HardwareError`] with a kind and a quantity.
    pub fn hardware_error(&self, error: impl Into<HardwareError>) {
        self.controls().hardware_error(self.path, error.into());
    }

    /// Topics, actuators, parameters and commands, by path.
    pub fn bus(&self) -> Bus {
        self.bus.clone()
    }

    fn controls(&self) -> &dyn Controls {
        self.bus.host.controls()
    }
}

impl Deref for CommandContext {
    type Target = Bus;
    fn deref(&self) -> &Bus {
        &self.bus
    }
}

/// The future of [`CommandContext::sleep`].
#[derive(Debug)]
pub struct Sleep {
    until: MonotonicTime,
    bus: Bus,
    sleeper: Sleeper,
    alarm: Option<Alarm>,
}

impl Future for Sleep {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        if self.bus.clock().now() >= self.until {
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
