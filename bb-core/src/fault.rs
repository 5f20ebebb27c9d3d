//! Why a component cannot start or go on, and how user code is called so that it harms nobody but itself.

mod guard;
mod value;

pub(crate) use guard::{Failed, caught, discard, guarded, of_panic, retire, wake};
pub use value::Fault;
pub(crate) use value::Then;
