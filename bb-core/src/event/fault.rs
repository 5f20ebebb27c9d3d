//! Failures of components.

use crate::message::Payload;
use std::fmt;

/// A component that has failed while the robot runs, published at `fault`.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct ComponentFault {
    /// The path of the component.
    pub path: &'static str,
    /// Message of the fault.
    pub message: String,
}

impl fmt::Display for ComponentFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} failed: {}", self.path, self.message)
    }
}

impl std::error::Error for ComponentFault {}
