//! Reasons for which a component ends.

use super::Fault;
use std::fmt;

/// Reason for which a component is terminated; `terminate` gets it.
///
/// ```
/// use bb_core::prelude::*;
///
/// # struct Gripper { is_open: bool }
/// # impl Gripper {
/// fn terminate(&mut self, reason: Termination<'_>) {
///     // At a restart, the next one is made at once: it keeps its hold.
///     if matches!(reason, Termination::Stop) {
///         self.is_open = true;
///     }
/// }
/// # }
/// # let mut gripper = Gripper { is_open: false };
/// # gripper.terminate(Termination::NewOptions);
/// # assert!(!gripper.is_open);
/// ```
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Termination<'a> {
    /// The robot stops.
    Stop,
    /// The component is made again with new options, since its `handle_options` takes none.
    NewOptions,
    /// The component is restarted with the others of its supervisor, one of which has panicked too often.
    Supervisor,
    /// One of its callbacks has returned this fault.
    Fault(&'a Fault),
}

impl fmt::Display for Termination<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stop => f.write_str("the robot stops"),
            Self::NewOptions => f.write_str("new options"),
            Self::Supervisor => f.write_str("restarted by its supervisor"),
            Self::Fault(fault) => write!(f, "it failed: {fault}"),
        }
    }
}
