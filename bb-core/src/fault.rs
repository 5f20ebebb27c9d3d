//! The errors of components, and calls of user code that contain its panics.

mod guard;
mod termination;
mod value;

pub(crate) use guard::{Failed, Panic, caught, discard, guarded, lock, log_panic, of_panic, retire, wake};
pub use termination::Termination;
pub use value::Fault;
pub(crate) use value::Then;
