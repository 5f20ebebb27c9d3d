//! A run on virtual time, driven by its caller.

use super::machine::Machine;
use super::source::OpenSources;
use super::visit::Visitable;
use super::{Live, Report, Robot, SensorHandle};
use crate::component::{Caller, Sensor};
use crate::time::{Clock, MonotonicTime};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// A robot on virtual time. Sensors are read in the order of their due times (equal ones in the order of their
/// declaration), on the caller's thread, as fast as the machine can, so every run gives the same outputs. Anything
/// else due at the same time follows: timers, then the watchdog, then commands, then their time limits.
pub struct Simulation<R: Robot> {
    /// Dropped before `live`.
    run: VirtualRun,
    live: Live<R>,
}

/// The numbers of sources by the times at which they are due, the earliest first.
type Due = BinaryHeap<Reverse<(MonotonicTime, usize)>>;

/// A run on virtual time, without the type of its robot.
struct VirtualRun {
    machine: Arc<Machine>,
    sources: OpenSources,
    due: Due,
}

/// Kind of the next event that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Source,
    Timer,
    Watch,
    Command,
    Limit,
}

impl<R: Robot> Simulation<R> {
    pub(super) fn new(live: Live<R>, sources: OpenSources) -> Self {
        Self { run: VirtualRun::new(Arc::clone(&live.machine), sources), live }
    }

    /// Returns the time at which the next sensor is due; `None` once all have finished.
    pub fn next_due(&self) -> Option<MonotonicTime> {
        self.run.next_due()
    }

    /// Moves time to the next due sensor and reads it, after anything else that is due before. Returns `false` once
    /// all sensors have finished.
    pub fn step(&mut self) -> bool {
        self.run.step()
    }

    /// Runs everything that is due up to `time`, and moves time there.
    pub fn run_until(&mut self, time: MonotonicTime) {
        self.run.run_until(time);
    }

    /// Runs for `duration` of virtual time.
    pub fn run_for(&mut self, duration: Duration) {
        self.run.run_until(self.clock().now() + duration);
    }

    /// Runs until every sensor has finished: for recordings, and simulated sensors that end.
    pub fn run_to_end(&mut self) {
        while self.run.step() {}
        self.run.run_until(self.clock().now());
    }

    /// Runs everything that is due up to `time`, moves time there, and publishes as if `sensor` had measured
    /// `payload` then. All estimators downstream run before this returns. A `time` in the past does not move time:
    /// the message is late.
    pub fn publish<S: Sensor>(&mut self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
        self.run.run_until(time);
        self.live.publish(sensor, time, payload);
        self.run.catch_up();
    }

    /// Makes the callbacks of an estimator appear to take this long from now on, to test its `latency_budget`: on
    /// virtual time, nothing takes time by itself.
    pub fn pretend_latency<V: Visitable<R>>(&self, estimator: V, latency: Duration) {
        let nanos = i64::try_from(latency.as_nanos()).unwrap_or(i64::MAX);
        self.live.machine.environment.node(estimator.number()).pretend_latency(nanos);
    }

    /// Stops sensors, then estimators, ends the subscriptions, and returns the last report.
    pub fn stop(mut self) -> Report {
        self.run.shut_down();
        self.live.report()
    }
}

impl VirtualRun {
    fn new(machine: Arc<Machine>, mut sources: OpenSources) -> Self {
        // A simulation of a recording starts when the recording was made.
        if let Some(first) = sources.iter_mut().filter_map(|source| source.starts_at()).min() {
            machine.environment.clock().start_at(first);
        }
        let now = machine.environment.clock().now();
        machine.control.begin_watch(now);
        machine.start_islands(now);
        machine.environment.drain_posted();
        // Faults of hardware errors that components reported during `init`.
        while machine.control.run_pending_hooks() {}
        sources.iter_mut().for_each(|source| source.begin());
        let due = due_of(&sources);
        machine.settle();
        Self { machine, sources, due }
    }

    fn clock(&self) -> &Clock {
        self.machine.environment.clock()
    }

    fn next_due(&self) -> Option<MonotonicTime> {
        self.due.peek().map(|Reverse((time, _))| *time)
    }

    fn step(&mut self) -> bool {
        self.catch_up();
        loop {
            match self.next() {
                Some((time, Kind::Source)) => {
                    self.fire(time, Kind::Source);
                    return true;
                }
                Some((time, kind)) if self.next_due().is_some() => self.fire(time, kind),
                _ => return false,
            }
        }
    }

    fn run_until(&mut self, time: MonotonicTime) {
        self.catch_up();
        while let Some((due, kind)) = self.next().filter(|(due, _)| *due <= time) {
            self.fire(due, kind);
        }
        self.clock().advance_to(time);
        self.machine.settle();
    }

    /// Returns the next event that is due, and its time; anything overdue is due now.
    fn next(&self) -> Option<(MonotonicTime, Kind)> {
        let now = self.clock().now();
        let machine = &self.machine;
        let control = &machine.control;
        let source = self.next_due().map(|time| (time, Kind::Source));
        let at = |time: Option<MonotonicTime>, kind| time.map(|time| (time.max(now), kind));
        let timer = at(machine.environment.agenda().next(), Kind::Timer);
        let watch = at(control.next_watch(), Kind::Watch);
        let command = if control.has_ready() { Some(now) } else { control.next_sleeper() };
        let command = at(command, Kind::Command);
        let limit = at(control.next_limit(), Kind::Limit);
        [source, timer, watch, command, limit].into_iter().flatten().min()
    }

    fn fire(&mut self, time: MonotonicTime, kind: Kind) {
        self.clock().advance_to(time);
        let now = self.clock().now();
        let machine = Arc::clone(&self.machine);
        match kind {
            Kind::Source => {
                let Some(Reverse((_, index))) = self.due.pop() else { return };
                let Some(source) = self.sources.get_mut(index) else { return };
                source.fire();
                if let Some(time) = source.due() {
                    self.due.push(Reverse((time, index)));
                }
            }
            Kind::Timer => {
                if let Some(number) = machine.environment.agenda().take(now)
                    && let Some(island) = machine.island(number)
                {
                    island.wake(now);
                }
            }
            Kind::Watch => drop(machine.control.check_watch(now)),
            Kind::Command => {
                while machine.control.wake_sleepers(now) {}
                machine.control.poll_ready();
            }
            Kind::Limit => drop(machine.control.check_limits(now)),
        }
        self.catch_up();
    }

    /// Handles the immediate consequences: posted entries, disarm callbacks, and orders to sensors.
    fn catch_up(&mut self) {
        let machine = &self.machine;
        machine.environment.drain_posted();
        while machine.control.run_pending_hooks() {
            machine.environment.drain_posted();
        }
        if machine.control.take_orders() {
            self.obey();
        }
        if self.machine.control.stop_signal().is_set() {
            self.stop_sources();
        }
        self.machine.settle();
    }

    /// Lets sensors carry out their orders at once.
    fn obey(&mut self) {
        for source in &mut self.sources {
            source.obey();
        }
        self.due = due_of(&self.sources);
    }

    fn stop_sources(&mut self) {
        self.due.clear();
        for mut source in self.sources.drain(..) {
            source.terminate();
        }
    }

    fn shut_down(&mut self) {
        let machine = Arc::clone(&self.machine);
        if machine.has_ended.load(Ordering::Acquire) {
            return;
        }
        self.catch_up();
        machine.control.begin_stop(&Caller::PROGRAM);
        machine.control.stop_signal().set();
        self.stop_sources();
        // One thread runs all of this, so nothing can be busy elsewhere.
        machine.retire_islands(std::time::Instant::now());
        machine.terminate_actuators(std::time::Instant::now());
        machine.close_door(std::time::Instant::now() + super::running::STOP_WITHIN);
        machine.settle();
        machine.end(std::time::Instant::now() + super::running::STOP_WITHIN);
    }
}

fn due_of(sources: &OpenSources) -> Due {
    let mut due = Due::new();
    for (index, source) in sources.iter().enumerate() {
        if let Some(time) = source.due() {
            due.push(Reverse((time, index)));
        }
    }
    due
}

impl<R: Robot> Deref for Simulation<R> {
    type Target = Live<R>;
    fn deref(&self) -> &Live<R> {
        &self.live
    }
}

impl Drop for VirtualRun {
    fn drop(&mut self) {
        self.shut_down();
    }
}

impl<R: Robot> fmt::Debug for Simulation<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Simulation").field(&R::NAME).finish()
    }
}
