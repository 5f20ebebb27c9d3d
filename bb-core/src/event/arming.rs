//! Errors of arming and disarming.

use super::{Forbidden, SafetyError};
use std::fmt;

/// Reason for which a robot is not armed.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArmError {
    /// The safety state is `error`; only a forced disarm leads out.
    Error,
    /// The robot is being disarmed.
    Disarming,
    /// The robot is stopping.
    Stopping,
    /// The code of these commands, which were cancelled, has not returned.
    Lingering(Vec<&'static str>),
    /// Components that were started on the disarmed robot, or could not be started, and whose disarm callbacks have not returned.
    MakingSafe(Vec<&'static str>),
    /// The robot was disarmed while this waited, or the command that arms it was cancelled.
    Cancelled,
    /// The robot is replayed: its journal says when it is armed.
    Replay,
    /// The caller may not arm it.
    Forbidden(Forbidden),
}

/// Reason for which a robot may not be safe.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum DisarmError {
    /// Disarm callbacks that failed or did not return in time.
    Failed(Vec<SafetyError>),
    /// The safety state is `error`, and this disarm was not forced, or hardware reported an error meanwhile.
    Error,
    /// A disarm callback or an actuator's own code called: the robot is being disarmed, and the caller would wait for
    /// itself.
    Callback,
    /// The robot is still being disarmed: its time limit has not been enforced yet, or another thread of a simulation
    /// runs the callbacks.
    Unfinished,
    /// The robot is replayed: its journal says when it is disarmed.
    Replay,
    /// The caller may not force it out of `error`.
    Forbidden(Forbidden),
}

impl fmt::Display for ArmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the robot was not armed: ")?;
        match self {
            Self::Error => f.write_str("its safety state is `error`, which only a forced disarm leaves"),
            Self::Disarming => f.write_str("it is being disarmed"),
            Self::Stopping => f.write_str("it stops"),
            Self::Lingering(paths) => {
                write!(f, "the code of cancelled commands has not returned: {}", paths.join(", "))
            }
            Self::MakingSafe(paths) => {
                write!(f, "what was started late is still being made safe: {}", paths.join(", "))
            }
            Self::Cancelled => f.write_str("it was disarmed meanwhile, or the command that arms it was cancelled"),
            Self::Replay => f.write_str("it is replayed"),
            Self::Forbidden(forbidden) => write!(f, "{forbidden}"),
        }
    }
}

impl fmt::Display for DisarmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Failed(errors) => {
                f.write_str("not everything could be made safe")?;
                for (index, SafetyError { path, error }) in errors.iter().enumerate() {
                    write!(f, "{}`{path}`: {}", if index == 0 { ": " } else { "; " }, error.message)?;
                }
                Ok(())
            }
            Self::Error => f.write_str("the safety state is `error`"),
            Self::Callback => {
                f.write_str("a disarm callback or an actuator's own code cannot wait for the robot to be disarmed")
            }
            Self::Unfinished => f.write_str("the robot is still being disarmed"),
            Self::Replay => f.write_str("the robot is replayed"),
            Self::Forbidden(forbidden) => write!(f, "{forbidden}"),
        }
    }
}

impl std::error::Error for ArmError {}

impl std::error::Error for DisarmError {}
