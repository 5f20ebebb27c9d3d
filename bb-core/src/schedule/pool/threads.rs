//! Threads as the pool needs them; a model has its own.

#[cfg(not(loom))]
mod real {
    pub(in super::super) use std::sync::{Mutex, MutexGuard};
    pub(in super::super) use std::thread::{Thread, current};
    use std::time::{Duration, Instant};

    pub(in super::super) fn spawn(name: String, run: super::Run) -> std::io::Result<()> {
        crate::schedule::start_thread(&name, run).map(drop)
    }

    /// Waits until the thread is unparked, `longest` at most. Returns whether it timed out.
    pub(in super::super) fn park(longest: Option<Duration>) -> bool {
        let Some(longest) = longest else {
            std::thread::park();
            return false;
        };
        let start = Instant::now();
        std::thread::park_timeout(longest);
        start.elapsed() >= longest
    }
}

#[cfg(loom)]
mod real {
    pub(in super::super) use loom::sync::{Mutex, MutexGuard};
    pub(in super::super) use loom::thread::{Thread, current};
    use std::time::Duration;

    pub(in super::super) fn spawn(_: String, run: super::Run) -> std::io::Result<()> {
        loom::thread::spawn(run);
        Ok(())
    }

    /// A model has no time: let the others run once.
    pub(in super::super) fn park(longest: Option<Duration>) -> bool {
        match longest {
            None => loom::thread::park(),
            Some(_) => loom::thread::yield_now(),
        }
        longest.is_some()
    }
}

pub(super) use real::{Mutex, MutexGuard, Thread, current, park, spawn};

/// The code of a thread.
pub(super) type Run = Box<dyn FnOnce() + Send>;

/// Starts a thread of that name.
pub(super) type Spawn = dyn Fn(String, Run) -> std::io::Result<()> + Send + Sync;
