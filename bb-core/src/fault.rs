//! The errors of components, calls of user code that contain its panics, and what a thread is inside of.

mod guard;
mod inside;
mod termination;
mod value;

pub(crate) use guard::{Failed, Panic, caught, discard, guarded, lock, log_panic, of_panic, retire, wake};
pub(crate) use inside::{Inside, Place, Within, enter, is_inside, leave, times_inside};
pub use termination::Termination;
pub use value::Fault;
pub(crate) use value::Then;
