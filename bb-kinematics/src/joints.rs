//! The states of a moving robot's joints over time, and its frames at any time.
//!
//! Each joint has a bounded history, ordered by the stamps of the messages that tell its state. [`Joints`] has the rules by which a
//! state at a time follows from it.

mod error;
mod frames;
mod history;
mod reading;
pub(crate) mod route;
mod snapshot;
mod states;
mod status;
mod store;

pub use error::{Gap, LookupError};
pub use frames::TransformHandle;
pub use route::{Latest, PlacedInput, Placement};
pub use status::{JointRefusal, JointStatistics, JointStatus};
pub use store::{JointSettings, Joints};

#[cfg(test)]
mod tests;
