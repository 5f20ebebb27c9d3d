//! The contract of an actuator.

use super::{ActuatorContext, Fault, Options, Termination};
use crate::message::{JointSide, Payload, Stamped};
use crate::time::MonotonicTime;

/// Moves a joint.
///
/// It gets its commands only while the robot is armed, one at a time, on the thread that sends them. The framework
/// starts and stops it with the robot, makes it safe when the robot is disarmed, and publishes the commands that it
/// carried out at its path. A command whose payload is a [`JointCommand`](crate::JointCommand), as the standard ones
/// are, is first held to the limits of the joint. An actuator reports its motions with
/// [`ActuatorContext::begin_motion`] and [`ActuatorContext::end_motion`].
///
/// ```
/// use bb_core::prelude::*;
///
/// /// The target position of a joint.
/// #[derive(Clone, Copy, Debug, Payload)]
/// pub struct Position {
///     /// rad or m.
///     pub position: f64,
/// }
///
/// /// A servo that assumes it has reached its commanded position.
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
    /// Options of the actuator: the struct that `Name(…)` in `robot!` fills.
    type Options: Options;
    /// The commands it takes.
    type Command: Payload;

    /// The side of the joint's `transmission` that it speaks of. With [`JointSide::Motor`], the runtime converts commands, after the
    /// limits of the joint are applied, and [`ActuatorContext::limit`] to the motor's side, and the motions that it reports to the
    /// joint's. All else speaks of the joint: what is sent, published and recorded. Without a transmission, both are the same.
    const SIDE: JointSide = JointSide::Joint;

    /// Opens the device, without moving anything.
    ///
    /// # Errors
    /// Any error keeps the robot from starting.
    fn init(options: Self::Options, context: &ActuatorContext) -> Result<Self, Fault>;

    /// Carries out a command.
    ///
    /// # Errors
    /// Any error is reported, and the actuator is made safe and restarted.
    fn handle_command(&mut self, command: &Stamped<Self::Command>) -> Result<(), Fault>;

    /// Returns the time at which to call [`update`](Self::update); asked after each call of the actuator's code. The default is `None`:
    /// never.
    fn next_update(&self) -> Option<MonotonicTime> {
        None
    }

    /// Goes on with a motion at the time that [`next_update`](Self::next_update) asked for, or later if it was busy.
    /// It is called in any safety state, so that it can report the end of a motion.
    ///
    /// # Errors
    /// As for [`handle_command`](Self::handle_command).
    fn update(&mut self, now: MonotonicTime) -> Result<(), Fault> {
        let _ = now;
        Ok(())
    }

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
    fn terminate(&mut self, reason: Termination<'_>) {
        let _ = reason;
    }
}
