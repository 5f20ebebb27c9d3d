//! A run on virtual time, driven by its caller.

use super::handle::Publisher;
use super::machine::Machine;
use super::{Report, Robot, SensorHandle, Source};
use crate::component::Sensor;
use crate::pubsub::{Overflow, Subscription};
use crate::time::{Clock, MonotonicTime};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fmt;
use std::time::{Duration, Instant};

/// A robot on virtual time. Sensors are read in the order of their due times (equal ones in the order of their
/// declaration), on the caller's thread, as fast as the machine can, so that every run gives the same outputs.
pub struct Simulation<R: Robot> {
    machine: Machine<R>,
    sources: Vec<Box<dyn Source>>,
    due: BinaryHeap<Reverse<(MonotonicTime, usize)>>,
}

impl<R: Robot> Simulation<R> {
    pub(super) fn new(machine: Machine<R>, mut sources: Vec<Box<dyn Source>>) -> Self {
        // A recording starts when it was made, and everything else with it.
        if let Some(first) = sources.iter().filter_map(|source| source.starts_at()).min() {
            machine.startup.clock.advance_to(first);
        }
        sources.iter_mut().for_each(|source| source.begin());
        let due = sources.iter().enumerate().filter_map(|(index, source)| Some(Reverse((source.due()?, index))));
        let due = due.collect();
        Self { machine, sources, due }
    }

    /// Its clock.
    pub fn clock(&self) -> &Clock {
        &self.machine.startup.clock
    }

    /// When the next sensor is due; none once all have finished.
    pub fn next_due(&self) -> Option<MonotonicTime> {
        self.due.peek().map(|Reverse((time, _))| *time)
    }

    /// Moves time on to the next sensor that is due and reads it; false once all have finished.
    pub fn step(&mut self) -> bool {
        let Some(Reverse((time, index))) = self.due.pop() else {
            return false;
        };
        self.clock().advance_to(time);
        if let Some(source) = self.sources.get_mut(index) {
            source.fire();
            self.due.extend(source.due().map(|due| Reverse((due, index))));
        }
        true
    }

    /// Runs everything that is due up to `time`, and moves time there.
    pub fn run_until(&mut self, time: MonotonicTime) {
        while self.next_due().is_some_and(|due| due <= time) {
            self.step();
        }
        self.clock().advance_to(time);
    }

    /// Runs for `duration` of virtual time.
    pub fn run_for(&mut self, duration: Duration) {
        self.run_until(self.clock().now() + duration);
    }

    /// Runs until every sensor has finished: for recordings, and simulated sensors that end.
    pub fn run_to_end(&mut self) {
        while self.step() {}
    }

    /// Runs everything that is due up to `time`, moves time there, and publishes as if `sensor` had measured `payload`
    /// then; all estimators downstream run before this returns. A `time` that is over already does not move time: the
    /// message is late.
    pub fn publish<S: Sensor>(&mut self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
        self.run_until(time);
        self.machine.publish(sensor, time, payload);
    }

    /// Subscribes from now on, with room for 1024 messages.
    pub fn subscribe<P: Publisher<R>>(&self, publisher: P) -> Subscription<P::Payload> {
        self.subscribe_with(publisher, Overflow::default())
    }

    /// Subscribes from now on, and says what happens when the subscriber is slow.
    pub fn subscribe_with<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        self.machine.subscribe(publisher, overflow)
    }

    /// What it has done so far.
    pub fn report(&self) -> Report {
        self.machine.report()
    }

    /// Stops sensors, then estimators, tells the subscribers, and gives the last report.
    pub fn stop(mut self) -> Report {
        self.shut_down();
        self.machine.report()
    }

    fn shut_down(&mut self) {
        self.machine.startup.stop.set();
        self.due.clear();
        for mut source in self.sources.drain(..) {
            source.terminate();
        }
        // One thread runs all of this, so that nothing can be busy elsewhere.
        self.machine.terminate(Instant::now());
    }
}

impl<R: Robot> Drop for Simulation<R> {
    fn drop(&mut self) {
        self.shut_down();
    }
}

impl<R: Robot> fmt::Debug for Simulation<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Simulation").field(&R::NAME).finish()
    }
}
