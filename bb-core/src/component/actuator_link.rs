//! Commands to an actuator by path.

use super::{Caller, Fault};
use crate::event::Safety;
use crate::message::{OutOfBounds, Payload};
use std::fmt;
use std::sync::Arc;

/// Sends commands of type `T` to one actuator.
///
/// If this link was obtained by a [`Command`](crate::Command) that is cancelled or times out, the link is dropped
/// with the command's future. That stops the joint, provided that command sent the last command that the actuator
/// carried out, and `T` has a stop command ([`JointCommand::stop`](crate::JointCommand::stop)).
pub struct ActuatorLink<T: Payload> {
    accepts: Arc<dyn Accepts<T>>,
    caller: Caller,
}

impl<T: Payload> ActuatorLink<T> {
    pub(super) fn new(accepts: Arc<dyn Accepts<T>>, caller: Caller) -> Self {
        Self { accepts, caller }
    }

    /// Sends a command, and returns once it has been carried out.
    ///
    /// # Errors
    /// The robot is not armed, the command holds a NaN, the actuator has failed, or the command that obtained this link has
    /// ended.
    pub fn send(&self, command: T) -> Result<(), ActuatorError> {
        self.apply(command).map(drop)
    }

    /// Sends a command as [`send`](Self::send) does, and returns the command that was carried out: with the limits of the joint
    /// applied. A controller uses it to see that its output was clamped.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn apply(&self, command: T) -> Result<T, ActuatorError> {
        self.accepts.accept(command, &self.caller)
    }

    /// Stops the joint with [`JointCommand::stop`](crate::JointCommand::stop), if there is such a command and the last one that
    /// the actuator carried out was sent by the [`Command`](crate::Command) that obtained this link. What somebody else moves, or
    /// what a link obtained outside of commands has sent, goes on.
    pub fn stop(&self) {
        self.accepts.stop_motion_of(&self.caller);
    }
}

impl<T: Payload> Drop for ActuatorLink<T> {
    fn drop(&mut self) {
        if !self.caller.is_valid() {
            self.accepts.stop_motion_of(&self.caller);
        }
    }
}

impl<T: Payload> fmt::Debug for ActuatorLink<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActuatorLink").finish_non_exhaustive()
    }
}

/// Reason for which an actuator has not carried out a command.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ActuatorError {
    /// The robot is not armed.
    NotArmed(Safety),
    /// The command or the session that sent this has ended or was cancelled; its handles no longer work.
    Cancelled,
    /// The command holds a NaN or an infinity.
    NonFinite,
    /// The command exceeds a limit of the joint and cannot be clamped to it.
    OutOfBounds(String),
    /// The code that applies the limits of the joint to the command ([`JointCommand::limit`](crate::JointCommand::limit))
    /// has panicked.
    NotLimited(String),
    /// The command could not be converted to the motor's side of the joint's transmission.
    NotConverted(String),
    /// The actuator has failed and does not run.
    Stopped,
    /// The actuator has failed at this command.
    Failed(String),
    /// The caller is the actuator's own code, or the code of another actuator which it waits for in turn, and would
    /// wait for itself.
    Inside,
}

impl fmt::Display for ActuatorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotArmed(safety) => write!(f, "the robot is not armed ({safety})"),
            Self::Cancelled => f.write_str("the command or the session that sent this has ended or was cancelled"),
            Self::NonFinite => f.write_str("the command holds a NaN or an infinity"),
            Self::OutOfBounds(message) => f.write_str(message),
            Self::NotLimited(message) => {
                write!(f, "the limits of the joint could not be applied to the command: {message}")
            }
            Self::NotConverted(message) => {
                write!(f, "the command could not be converted to the motor of the joint: {message}")
            }
            Self::Stopped => f.write_str("the actuator has failed and does not run"),
            Self::Failed(message) => write!(f, "the actuator failed: {message}"),
            Self::Inside => {
                f.write_str("the code of an actuator cannot send to it while it waits for that actuator itself")
            }
        }
    }
}

impl std::error::Error for ActuatorError {}

impl From<OutOfBounds> for ActuatorError {
    fn from(out: OutOfBounds) -> Self {
        Self::OutOfBounds(out.to_string())
    }
}

/// An actuator that takes commands of type `T`.
pub(crate) trait Accepts<T>: Send + Sync {
    /// Returns the command with the limits applied.
    fn accept(&self, command: T, caller: &Caller) -> Result<T, ActuatorError>;
    /// Stops the joint if the last command carried out came from that caller.
    fn stop_motion_of(&self, caller: &Caller);
}

/// An actuator that takes commands in JSON.
pub(crate) trait AcceptsJson: Send + Sync {
    /// Returns the command with the limits applied.
    fn accept_json(&self, command: &str, caller: &Caller) -> Result<String, Fault>;
}
