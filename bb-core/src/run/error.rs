//! Errors at the start of a robot.

use crate::fault::Fault;
use std::fmt;

/// A robot does not start: which component failed, and why. `Debug` prints the same as `Display`, since a `main` that
/// returns it shows `Debug`.
pub struct StartError {
    path: &'static str,
    fault: Fault,
}

impl StartError {
    pub(crate) fn component(path: &'static str, fault: Fault) -> Self {
        Self { path, fault }
    }

    /// The path of the component.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// Returns the reason for which the robot does not start.
    pub fn fault(&self) -> &Fault {
        &self.fault
    }
}

impl fmt::Display for StartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} cannot start: {}", self.path, self.fault)
    }
}

impl fmt::Debug for StartError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for StartError {}
