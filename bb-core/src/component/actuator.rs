//! The contract of an actuator.

use super::{ActuatorContext, Fault, Options, Permit};
use crate::event::Safety;
use crate::message::{Payload, Stamped};
use std::fmt;

/// Moves a joint.
///
/// It gets its commands only while the robot is armed, one at a time, on the thread that sends them. Simulation, motion
/// and kinematics are later work of this framework; what is here starts and stops an actuator with the robot, makes it
/// safe when the robot is disarmed, and lets everybody see what it was told, at its path.
///
/// ```
/// use bb_core::prelude::*;
///
/// /// Where a joint is to go.
/// #[derive(Clone, Copy, Debug, Payload)]
/// pub struct Position {
///     /// rad or m.
///     pub position: f64,
/// }
///
/// /// A servo that believes that it is where it was told to go.
/// #[derive(Debug, Default)]
/// pub struct Servo {
///     target: f64,
///     has_torque: bool,
/// }
///
/// impl Actuator for Servo {
///     type Options = NoOptions;
///     type Command = Position;
///
///     fn init(_: NoOptions, _: &ActuatorContext) -> Result<Self, Fault> {
///         Ok(Self::default())
///     }
///
///     fn handle_command(&mut self, command: &Stamped<Position>) -> Result<(), Fault> {
///         (self.target, self.has_torque) = (command.position, true);
///         Ok(())
///     }
///
///     fn disarm(&mut self) -> Result<(), Fault> {
///         self.has_torque = false;
///         Ok(())
///     }
/// }
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an actuator",
    label = "cannot be declared with `actuator`",
    note = "implement `bb_core::Actuator` for it"
)]
pub trait Actuator: Sized + Send + 'static {
    /// What `Name(…)` in `robot!` fills.
    type Options: Options;
    /// What it is told.
    type Command: Payload;

    /// Opens the device, without moving anything.
    ///
    /// # Errors
    /// What keeps it from starting; the robot then does not start.
    fn init(options: Self::Options, context: &ActuatorContext) -> Result<Self, Fault>;

    /// Does what it is told.
    ///
    /// # Errors
    /// Why it cannot go on; the fault is reported, and the actuator is made safe and restarted.
    fn handle_command(&mut self, command: &Stamped<Self::Command>) -> Result<(), Fault>;

    /// Makes it safe. Called whenever the robot is disarmed, and before a restart; it must return within 5 s.
    ///
    /// # Errors
    /// Why it could not be made safe: the robot's safety state is then `error`.
    fn disarm(&mut self) -> Result<(), Fault>;

    /// Takes new options, validated, after a parameter that they are bound to has changed. The default restarts the
    /// actuator with them: it is made safe, terminated and dropped before the new one is made.
    ///
    /// # Errors
    /// As for `handle_command`.
    fn handle_options(&mut self, options: Self::Options, context: &ActuatorContext) -> Result<(), Fault> {
        let _ = (options, context);
        Err(Fault::remake())
    }

    /// Closes the device before the actuator stops or is restarted; not called after a panic.
    fn terminate(&mut self) {}
}

/// Why an actuator has not carried out a command.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ActuatorError {
    /// The robot is not armed.
    NotArmed(Safety),
    /// The command that sent this has ended or was cancelled: its handles are dead.
    Cancelled,
    /// The command holds a NaN or an infinity.
    NonFinite,
    /// The actuator has failed and does not run.
    Stopped,
    /// The actuator has failed at this command.
    Failed(String),
    /// The actuator's own code has sent this, and would wait for itself.
    Inside,
}

impl fmt::Display for ActuatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotArmed(safety) => write!(f, "the robot is not armed ({safety})"),
            Self::Cancelled => f.write_str("the command that sent this has ended or was cancelled"),
            Self::NonFinite => f.write_str("the command holds a NaN or an infinity"),
            Self::Stopped => f.write_str("the actuator has failed and does not run"),
            Self::Failed(message) => write!(f, "the actuator failed: {message}"),
            Self::Inside => {
                f.write_str("the actuator's own code cannot send to it, since it would wait for itself")
            }
        }
    }
}

impl std::error::Error for ActuatorError {}

/// An actuator that takes commands of type `T`.
pub(crate) trait Accepts<T>: Send + Sync {
    fn accept(&self, command: T, permit: &Permit) -> Result<(), ActuatorError>;
}
