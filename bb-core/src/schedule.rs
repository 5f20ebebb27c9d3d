//! Due times, and the threads that do what is due.

mod agenda;
mod bell;
mod deadlines;
mod door;
mod pool;
mod reserve;
mod sleeper;
mod stop;

mod thread;

pub(crate) use agenda::Agenda;
pub(crate) use bell::Bell;
pub(crate) use deadlines::Deadlines;
pub(crate) use door::Door;
pub(crate) use pool::{Lane, Pool};
pub(crate) use reserve::{Reserve, Reserved};
pub(crate) use sleeper::{Alarm, Sleeper};
pub(crate) use stop::StopSignal;
pub(crate) use thread::start_thread;
