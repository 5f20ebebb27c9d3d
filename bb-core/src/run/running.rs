//! A run in real time, with a thread for each sensor.

use super::machine::Machine;
use super::source::OpenSources;
use super::threads::{self, Thread};
use super::{Live, Report, Robot, StartError};
use crate::component::Caller;
use crate::fault::{Place, is_inside, lock};
use crate::schedule::Reserved;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A robot that runs in real time. Dropping it stops it.
///
/// A process that ends without dropping it disarms nothing. So own it in `main`, return from `main` rather than calling
/// [`std::process::exit`], and give other threads a [`Live`]: if one of them owns the `Running` while `main` returns, it is not
/// dropped. Nor is it after `mem::forget`, in a `static`, or when the process aborts (`panic = "abort"`, a panic while another
/// unwinds, a stack overflow, no memory) or is killed. Hardware that must be safe then needs its own watchdog.
pub struct Running<R: Robot> {
    /// Dropped before `live`.
    threads: Threads,
    live: Live<R>,
}

/// The threads of a run.
struct Threads {
    machine: Arc<Machine>,
    /// Threads of sensors and services.
    sources: Vec<Thread>,
    /// `true` if [`Running::wait`] has left threads running at its limit, so that a stop need not wait as long again.
    has_waited: bool,
    /// Thread reserved for disarm callbacks of commands.
    kept: Option<Reserved>,
}

/// Time within which user code must return after the robot was asked to stop.
pub(super) const STOP_WITHIN: Duration = Duration::from_secs(5);

/// Least time left to user code once disarm callbacks have used up the time of the stop.
const GRACE: Duration = Duration::from_millis(400);

/// Time within which a stop returns, even if code hangs. Includes all of the above and the last lines of the journal.
const BACK_WITHIN: Duration = Duration::from_millis(5800);

/// Time within which loggers must write the last lines. Without this wait, a program that ends after `stop` would not log the hardware
/// that could not be made safe.
const LINES_WITHIN: Duration = Duration::from_millis(150);

impl<R: Robot> Running<R> {
    pub(super) fn start(live: Live<R>, sources: OpenSources) -> Result<Self, StartError> {
        Ok(Self { threads: Threads::start(Arc::clone(&live.machine), sources)?, live })
    }

    /// Waits until every sensor and service has finished: at the end of recordings and simulated sensors, and after
    /// [`Live::request_stop`]. Those that have not returned 5 s after that are left running and reported as faults; then
    /// [`stop`](Self::stop) waits for other code as if those 5 s had been its own.
    pub fn wait(&mut self) {
        self.threads.wait();
    }

    /// Disarms the robot and cancels commands at once, even if code hangs. Then stops sensors and services, then
    /// estimators and actuators; ends the subscriptions, and returns the last report. Code that has not returned 5 s
    /// after the call is left running and reported as a fault.
    pub fn stop(mut self) -> Report {
        self.threads.shut_down();
        self.live.report()
    }
}

impl Threads {
    fn start(machine: Arc<Machine>, sources: OpenSources) -> Result<Self, StartError> {
        let mut running =
            Self { machine: Arc::clone(&machine), sources: Vec::new(), has_waited: false, kept: None };
        machine.control.pool().start();
        let kept = machine.control.start_reserve();
        running.kept = Some(kept.map_err(|(path, fault)| StartError::component(path, fault))?);
        // On an error here, `running` is dropped, which stops what already runs, in order.
        threads::serve(&machine)?;
        let now = machine.environment.clock().now();
        machine.control.begin_watch(now);
        // Before any message can arrive, since requests of `init` come first.
        machine.start_islands(now);
        machine.control.begin_sources(sources.len());
        for source in sources {
            running.sources.push(threads::source(source, &machine)?);
        }
        Ok(running)
    }

    fn wait(&mut self) {
        let have_finished = self.machine.control.wait_for_sources();
        let start = Instant::now();
        if !have_finished {
            self.machine.control.wait_until_disarmed();
        }
        self.join(self.deadline(start));
    }

    /// Returns the time by which user code that was told to stop at `start` should have returned.
    fn deadline(&self, start: Instant) -> Instant {
        let machine = &self.machine;
        // If the caller is code of the robot itself, that code cannot end before this call returns.
        let is_inside =
            is_inside(Place::Command(machine.control.id())) || machine.islands().any(|island| island.is_inside());
        if self.has_waited || is_inside {
            return Instant::now() + GRACE;
        }
        (start + STOP_WITHIN).max(Instant::now() + GRACE)
    }

    /// Joins the threads of sensors and services. Those still running at `deadline` are left and reported.
    fn join(&mut self, deadline: Instant) {
        let machine = &self.machine;
        for (path, thread) in std::mem::take(&mut self.sources) {
            let Err(message) = threads::join(thread, deadline) else { continue };
            self.has_waited = true;
            let sources = lock(&machine.sources);
            let entered =
                sources.iter().find(|source| source.path() == path).and_then(|source| source.entered_at());
            drop(sources);
            let since = threads::since(entered, machine.environment.clock().now());
            machine.fault(path, format!("{message}{since}"));
        }
    }

    fn shut_down(&mut self) {
        let machine = Arc::clone(&self.machine);
        if machine.has_ended.load(Ordering::Acquire) {
            return;
        }
        let start = Instant::now();
        machine.control.begin_stop(&Caller::PROGRAM);
        machine.control.wait_until_disarmed();
        let deadline = self.deadline(start);
        self.join(deadline);
        machine.retire_islands(deadline);
        for path in machine.control.lingering(deadline) {
            machine.fault(path, "did not come back when the robot stopped".to_owned());
        }
        machine.terminate_actuators(deadline);
        machine.close_door(deadline);
        machine.end(start + BACK_WITHIN);
        machine.control.wait_for_lines(LINES_WITHIN);
    }
}

impl<R: Robot> Deref for Running<R> {
    type Target = Live<R>;
    fn deref(&self) -> &Live<R> {
        &self.live
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.shut_down();
    }
}

impl<R: Robot> fmt::Debug for Running<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Running").field(&R::NAME).finish()
    }
}
