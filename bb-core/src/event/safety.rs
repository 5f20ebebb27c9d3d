//! Whether the robot may move.

use crate::message::Payload;
use std::fmt;

/// Whether the robot may move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Payload)]
pub enum Safety {
    /// Motion is inhibited.
    #[default]
    Disarmed,
    /// Motion is enabled.
    Armed,
    /// Motion is inhibited, and the disarm callbacks run.
    Disarming,
    /// Something could not be made safe, or panicked too often; only a forced disarm leaves this state.
    Error,
}

impl fmt::Display for Safety {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Disarmed => "disarmed",
            Self::Armed => "armed",
            Self::Disarming => "disarming",
            Self::Error => "error",
        })
    }
}

/// A change of the safety state, published at `safety`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct SafetyTransition {
    /// The previous state.
    pub from: Safety,
    /// The new state.
    pub to: Safety,
}

/// Why the safety state is `error`, published at `safety/error`.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct SafetyError {
    /// The component.
    pub path: &'static str,
    /// What happened.
    pub message: String,
}
