//! Starting a thread.

use std::io;
use std::thread::{Builder, JoinHandle};

/// Starts a thread of that name. `run` has no type of its own, so that what the standard library does for it is compiled once.
pub(crate) fn start_thread(name: &str, run: Box<dyn FnOnce() + Send>) -> io::Result<JoinHandle<()>> {
    Builder::new().name(name.to_owned()).spawn(run)
}
