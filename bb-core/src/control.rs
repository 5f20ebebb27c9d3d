//! The robot as a whole: commands, operational state, safety, parameters, supervision and health, and the topics on which
//! they are seen.
//!
//! This state has a single writer of the same kind as an island: a thread with an entry takes the lock for some
//! microseconds, writes the entry's line into the journal, changes the state and publishes what has changed. No user code runs in there.
//! What follows from an entry and is user code (disarm callbacks, futures of commands, wakers, handlers, loggers) is collected
//! as `Effects` and run without the lock, on threads of its own or of the pool: each may block for ever,
//! and harms only itself.

mod apart;
mod arming;
mod budgets;
mod callback;
mod command;
mod commands;
mod effects;
mod execution;
mod hanging;
mod health;
mod hooks;
mod inside;
mod machine;
#[cfg(all(test, loom))]
mod model;
mod parameters;
mod step;
mod stopping;
mod system;
mod task;
mod topics;

pub use command::{CommandStatistics, Prepared};
pub use execution::{CommandError, Execution};
pub(crate) use hanging::Hanging;
pub(crate) use system::{ComponentOrder, Control, Declared, Islands, Parts, Summary, Wired};
pub(crate) use topics::SystemTopics;
