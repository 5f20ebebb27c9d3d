//! The effects of a control-state entry that are user code. They run without the lock, on threads that nothing else
//! waits for.
//!
//! Disarm callbacks begin first, then the lines for loggers; only then comes what may block on this thread. Lines are queued under the
//! lock, so they are in the order of the entries, and at most one thread at a time hands them to loggers.

use super::callbacks::{Callback, Reason, is_awaited};
use super::execution::{CommandError, EndedCode, Slot, Task, Value};
use super::{Control, Wired};
use crate::event::{ComponentFault, HealthTransition, Refusal, Safety, SafetyError};
use crate::fault::{discard, guarded, lock};
use crate::node::Mode;
use crate::pubsub::{Alarms, Wakers};
use crate::schedule::{Lane, Sleeper};
use crate::telemetry::TelemetryEvent;
use crate::time::{Clock, MonotonicTime};
use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::task::Waker;
use std::time::{Duration, Instant};

/// Effects of an entry, see the [module](self).
#[derive(Default)]
pub(super) struct Effects {
    pub(super) wakers: Wakers,
    logs: Vec<Log>,
    /// Lines for loggers are queued, and no thread writes them yet.
    has_lines: bool,
    /// Commands to begin.
    pub(super) begun: Vec<Arc<Task>>,
    /// Commands whose futures are to be dropped.
    pub(super) cancelled: Vec<Arc<Task>>,
    pub(super) results: Vec<(Arc<Slot>, Result<Value, CommandError>)>,
    /// Disarm callbacks to run.
    pub(super) callbacks: Vec<(Reason, Vec<Arc<Callback>>)>,
    /// Values of users.
    pub(super) dropped: Vec<Value>,
    /// References to the wiring, which may be the last ones.
    pub(super) wired: Vec<Wired>,
    /// Commands that arm the robot, whose code had ended while something was being made safe.
    pub(super) ended: Vec<EndedCode>,
}

/// A message for loggers and telemetry handlers.
#[derive(Clone, Debug)]
pub(super) enum Log {
    Health(HealthTransition),
    Safety { from: Safety, to: Safety },
    State { from: &'static str, to: &'static str, command: Option<&'static str> },
    SafetyError(SafetyError),
    Fault(ComponentFault),
    Refused(Refusal),
}

/// Lines for loggers, in order. Loggers are user code and may block, so at most one thread of the pool runs them at a time.
#[derive(Default)]
pub(super) struct Reporter(Mutex<Reports>);

#[derive(Default)]
struct Reports {
    logs: VecDeque<Log>,
    is_running: bool,
    skipped: u64,
}

/// The number of lines that may wait for a logger that blocks. Further lines are counted and dropped.
const MOST_LOGS: usize = 4096;

impl Reporter {
    /// Returns true if no thread is writing lines, so that the caller has to start one.
    fn queue(&self, logs: impl IntoIterator<Item = Log>) -> bool {
        let mut reports = lock(&self.0);
        for log in logs {
            if reports.logs.len() < MOST_LOGS {
                reports.logs.push_back(log);
            } else {
                reports.skipped += 1;
            }
        }
        !std::mem::replace(&mut reports.is_running, true)
    }
}

impl Effects {
    pub(super) fn log(&mut self, log: Log) {
        self.logs.push(log);
    }

    /// Queues the lines for loggers. Called under the lock of the control state, to keep the order of the entries.
    pub(super) fn queue_lines(&mut self, control: &Control) {
        // The model does not include the pool's threads.
        if !self.logs.is_empty() && !cfg!(loom) {
            self.has_lines = control.0.reporter.queue(self.logs.drain(..));
        }
    }

    pub(super) fn run(self, control: &Control) {
        let Self { wakers, logs: _, has_lines, begun, cancelled, results, callbacks, dropped, wired, ended } = self;
        // Hardware comes first.
        let mut here = Vec::new();
        for (reason, all) in callbacks {
            here.push((reason, control.start_callbacks(reason, all)));
        }
        // Before anything that may block: until then, no other thread writes lines.
        if has_lines {
            control.start_writing_logs();
        }
        for (reason, callbacks) in here {
            callbacks.iter().for_each(|callback| callback.run(control, reason));
            discard(callbacks);
        }
        if !wakers.is_empty() {
            let counted = control.clone();
            control.run_on_pool(Lane::User, move || counted.count_waker_panics(wakers.run()));
        }
        let (mut dropped, mut woken) = (dropped, Vec::new());
        for (slot, result) in results {
            let (waker, late) = slot.set(result);
            woken.extend(waker);
            dropped.extend(late);
        }
        if !(woken.is_empty() && dropped.is_empty()) {
            let woken_by = control.clone();
            control.run_on_pool(Lane::User, move || {
                woken.into_iter().for_each(|waker| woken_by.wake(waker));
                dropped.into_iter().for_each(discard);
            });
        }
        drop(wired);
        for task in cancelled {
            task.cancel();
        }
        for task in begun {
            task.schedule();
        }
        for EndedCode { id, end, value } in ended {
            control.apply_outcome(id, end, value);
        }
    }
}

impl Control {
    /// Runs user code on a thread of the pool, where it delays nothing else; on virtual time, on the caller's thread.
    pub(crate) fn run_on_pool(&self, lane: Lane, code: impl FnOnce() + Send + 'static) {
        match self.0.mode {
            // A model does not include the pool's threads.
            Mode::Real if !cfg!(loom) => self.0.pool.submit(lane, code),
            Mode::Real | Mode::Virtual | Mode::Replay => code(),
        }
    }

    /// Schedules a command to be polled.
    pub(super) fn run_task(&self, task: Arc<Task>) {
        match self.0.mode {
            Mode::Real => self.0.pool.submit(task.lane(), move || task.run()),
            Mode::Virtual | Mode::Replay => lock(&self.0.ready).push_back(task),
        }
    }

    /// Runs each disarm callback on its own thread. On virtual time those of a disarming wait for [`Self::run_pending_hooks`], and the
    /// caller runs the others, which are returned.
    fn start_callbacks(&self, reason: Reason, all: Vec<Arc<Callback>>) -> Vec<Arc<Callback>> {
        match reason {
            Reason::Disarming(generation) if self.0.mode != Mode::Real => {
                lock(&self.0.pending_hooks).push_back((generation, all));
                return Vec::new();
            }
            Reason::Disarming(generation) if all.is_empty() => self.hook_returned(generation, None, None),
            // A model has room for few threads.
            Reason::Apart(_) if self.0.mode != Mode::Real || cfg!(loom) => return all,
            Reason::Disarming(_) | Reason::Apart(_) => {}
        }
        all.iter().for_each(|callback| callback.start(self, reason));
        all.into_iter().for_each(discard);
        Vec::new()
    }

    /// Runs the waiting disarm callbacks in order on the calling thread, on virtual time, and returns true if there were any. None of
    /// them runs inside code that it would wait for.
    pub(crate) fn run_pending_hooks(&self) -> bool {
        if is_awaited(self.id()) {
            return false;
        }
        let Some((generation, all)) = lock(&self.0.pending_hooks).pop_front() else { return false };
        if all.is_empty() {
            self.hook_returned(generation, None, None);
        }
        all.iter().for_each(|callback| callback.run(self, Reason::Disarming(generation)));
        discard(all);
        true
    }

    pub(super) fn keep_safety_error(&self, error: SafetyError, now: MonotonicTime) {
        lock(&self.0.safety_errors).add(error, now);
    }

    pub(super) fn keep_fault(&self, fault: ComponentFault, now: MonotonicTime) {
        lock(&self.0.faults).add(fault, now);
    }

    fn start_writing_logs(&self) {
        match self.0.mode {
            Mode::Real => {
                let control = self.clone();
                self.0.pool.submit(Lane::Robot, move || control.write_logs());
            }
            Mode::Virtual | Mode::Replay => self.write_logs(),
        }
    }

    /// Waits until loggers have all lines written so far, `longest` at most.
    pub(crate) fn wait_for_lines(&self, longest: Duration) {
        let deadline = Instant::now() + longest;
        while lock(&self.0.reporter.0).is_running && Instant::now() < deadline {
            std::thread::sleep(Duration::from_micros(100));
        }
    }

    /// Calls a logger. A panic in it, which cannot be logged, is counted.
    pub(crate) fn log(&self, write: impl FnOnce()) {
        if guarded(write).is_err() {
            self.0.logger_panics.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn write_logs(&self) {
        loop {
            let mut reports = lock(&self.0.reporter.0);
            let Some(log) = reports.logs.pop_front() else {
                reports.is_running = false;
                return;
            };
            let skipped = std::mem::take(&mut reports.skipped);
            drop(reports);
            self.log(|| {
                if skipped > 0 {
                    tracing::warn!(skipped, "lines of this log were dropped: the logger blocked");
                }
                write_log(&log);
            });
            if let Some(telemetry) = &self.0.telemetry {
                let robot = self.0.origin.robot;
                match log {
                    Log::Health(transition) => telemetry.tell(robot, &TelemetryEvent::Transition(transition)),
                    Log::Fault(fault) => telemetry.tell(robot, &TelemetryEvent::Fault(fault)),
                    _ => {}
                }
            }
        }
    }
}

fn write_log(log: &Log) {
    // If the program has installed no subscriber, failures are printed to the terminal.
    let is_plain = !tracing::dispatcher::has_been_set();
    match log {
        Log::Health(HealthTransition { estimator, source, from, to, reason, time }) => {
            tracing::info!(estimator, source, %from, %to, %reason, %time, "health changed");
        }
        Log::Safety { from, to } => tracing::info!(%from, %to, "safety changed"),
        Log::State { from, to, command } => tracing::info!(from, to, command, "state changed"),
        Log::SafetyError(SafetyError { path, error }) => {
            let quantity = error.quantity.map(tracing::field::display);
            let (text, kind) = (error.message.as_str(), error.kind.name());
            tracing::error!(component = path, error = text, kind, quantity, "safety error");
            if is_plain {
                eprintln!("safety error at {path}: {error}");
            }
        }
        Log::Fault(fault) => {
            tracing::warn!(component = fault.path, fault = fault.message, "component failed");
            if is_plain {
                eprintln!("{fault}");
            }
        }
        Log::Refused(refusal) => {
            tracing::warn!(command = refusal.command, %refusal, "command refused");
        }
    }
}

/// The clock and the alarms of a run, for subscriptions with a highest rate. They do not keep the control state alive, whose topics have them.
struct RunAlarms {
    clock: Clock,
    sleeper: Sleeper,
}

impl Alarms for RunAlarms {
    fn now(&self) -> MonotonicTime {
        self.clock.now()
    }

    fn wake_at(&self, time: MonotonicTime, waker: Waker) {
        self.sleeper.wake_at(time, None, waker);
    }
}

impl Control {
    /// Subscribers are woken as other code of users is.
    pub(crate) fn alarms(&self) -> impl Alarms + 'static {
        RunAlarms { clock: self.0.clock.clone(), sleeper: self.0.sleeper.in_lane(Lane::User) }
    }
}
