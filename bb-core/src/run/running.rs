//! A run in real time: each sensor on a thread of its own.

use super::handle::Publisher;
use super::machine::Machine;
use super::startup::Startup;
use super::{Report, Robot, SensorHandle, Source, StartError};
use crate::component::{Fault, Sensor};
use crate::pubsub::{Overflow, Subscription};
use crate::time::{Clock, MonotonicTime};
use std::fmt;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A robot that runs in real time. Dropping it stops it.
pub struct Running<R: Robot> {
    machine: Machine<R>,
    threads: Vec<(&'static str, JoinHandle<()>)>,
}

/// How long sensors, and then estimators, may take to come back after the robot was told to stop.
const STOP_WITHIN: Duration = Duration::from_secs(5);

impl<R: Robot> Running<R> {
    pub(super) fn start(machine: Machine<R>, sources: Vec<Box<dyn Source>>) -> Result<Self, StartError> {
        let mut running = Self { machine, threads: Vec::new() };
        for source in sources {
            let (path, startup) = (source.path(), running.machine.startup.clone());
            let thread = std::thread::Builder::new().name(path.to_owned());
            match thread.spawn(move || drive(source, &startup)) {
                Ok(thread) => running.threads.push((path, thread)),
                // Dropping what runs already stops it in order.
                Err(error) => return Err(StartError::component(path, Fault::from(error))),
            }
        }
        Ok(running)
    }

    /// Its clock.
    pub fn clock(&self) -> &Clock {
        &self.machine.startup.clock
    }

    /// Publishes as if `sensor` had measured `payload` at `time`; all estimators downstream run before this returns.
    pub fn publish<S: Sensor>(&self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
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

    /// Waits until every sensor has finished: for recordings, and simulated sensors that end.
    pub fn wait(&mut self) {
        for (path, thread) in std::mem::take(&mut self.threads) {
            self.join(path, thread);
        }
    }

    /// Tells the subscribers, stops sensors, then estimators, and gives the last report. What does not come back from
    /// its code, first of all sensors and then of all estimators, within 5 s is left behind and reported as a fault.
    pub fn stop(mut self) -> Report {
        self.shut_down();
        self.machine.report()
    }

    fn shut_down(&mut self) {
        self.machine.startup.stop.set();
        let deadline = Instant::now() + STOP_WITHIN;
        for (path, thread) in std::mem::take(&mut self.threads) {
            while !thread.is_finished() && Instant::now() < deadline {
                std::thread::sleep(Duration::from_millis(1));
            }
            if thread.is_finished() {
                self.join(path, thread);
            } else {
                let message = "did not come back from its read, or from an estimator downstream, in time";
                self.machine.startup.faults.add(path, message.into());
            }
        }
        self.machine.terminate(Instant::now() + STOP_WITHIN);
    }

    fn join(&self, path: &'static str, thread: JoinHandle<()>) {
        if thread.join().is_err() {
            self.machine.startup.faults.add(path, "its thread panicked".into());
        }
    }
}

fn drive(mut source: Box<dyn Source>, startup: &Startup) {
    source.begin();
    while let Some(due) = source.due() {
        let wait = due.duration_since(startup.clock.now());
        if !wait.is_zero() {
            startup.stop.sleep(wait);
        }
        if startup.stop.is_set() {
            break;
        }
        source.fire();
    }
    source.terminate();
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
