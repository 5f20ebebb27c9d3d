//! A run in real time: each sensor on a thread of its own.

use super::machine::Machine;
use super::threads::{self, Thread};
use super::{Live, Report, Robot, Source, StartError};
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A robot that runs in real time. Dropping it stops it.
pub struct Running<R: Robot> {
    live: Live<R>,
    /// Of sensors and services.
    sources: Vec<Thread>,
    /// Of workers, of what is due, and of commands.
    servers: Vec<Thread>,
}

/// How long sensors, and then estimators, may take to come back after the robot was told to stop.
const STOP_WITHIN: Duration = Duration::from_secs(5);

impl<R: Robot> Running<R> {
    pub(super) fn start(machine: Machine<R>, sources: Vec<Box<dyn Source>>) -> Result<Self, StartError> {
        let mut running = Self { live: Live(Arc::new(machine)), sources: Vec::new(), servers: Vec::new() };
        // What goes wrong here drops what runs already, which stops it in order.
        threads::serve(&running.live.0, &mut running.servers)?;
        let now = running.clock().now();
        (0..R::ISLANDS.len()).for_each(|island| running.live.0.startup.agenda().wake_at(now, island));
        for source in sources {
            running.sources.push(threads::source(source, &running.live.0.startup)?);
        }
        Ok(running)
    }

    /// Waits until every sensor and service has finished: for recordings, and simulated sensors that end.
    pub fn wait(&mut self) {
        for (path, thread) in std::mem::take(&mut self.sources) {
            if let Err(message) = threads::join(thread, None) {
                self.live.0.fault(path, message);
            }
        }
    }

    /// Cancels commands and disarms, tells the subscribers, stops sensors, then estimators and actuators, and gives the
    /// last report. What does not come back from its code, first of all sensors and then of all estimators, within 5 s is
    /// left behind and reported as a fault.
    pub fn stop(mut self) -> Report {
        self.shut_down();
        self.live.0.report()
    }

    fn shut_down(&mut self) {
        self.live.request_stop();
        let deadline = Instant::now() + STOP_WITHIN;
        for (path, thread) in std::mem::take(&mut self.sources).into_iter().chain(std::mem::take(&mut self.servers))
        {
            if let Err(message) = threads::join(thread, Some(deadline)) {
                self.live.0.fault(path, message);
            }
        }
        self.live.0.terminate(STOP_WITHIN);
    }
}

impl<R: Robot> Deref for Running<R> {
    type Target = Live<R>;
    fn deref(&self) -> &Live<R> {
        &self.live
    }
}

impl<R: Robot> Drop for Running<R> {
    fn drop(&mut self) {
        self.shut_down();
    }
}

impl<R: Robot> fmt::Debug for Running<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Running").field(&R::NAME).finish()
    }
}
