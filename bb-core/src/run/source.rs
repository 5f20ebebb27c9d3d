//! A running sensor: when it is read, and what becomes of a reading.

use super::{Failed, Robot, Startup, caught, retire};
use crate::component::{Fault, Next, Sensor, SensorContext};
use crate::message::{Frame, Stamp, Stamped};
use crate::time::MonotonicTime;
use crate::topology::Transform;
use std::sync::Arc;

/// A sensor as declared.
#[derive(Clone, Copy, Debug)]
pub struct SensorDeclaration {
    /// Its path: `sensor/base_link/imu`.
    pub path: &'static str,
    /// The frame of what it publishes.
    pub frame: Frame,
    /// Nanoseconds between two readings, if it has a `rate`.
    pub period_nanos: Option<i64>,
    /// Takes points from its frame to the root link's, if only fixed joints lie between.
    pub root_from_frame: Option<Transform>,
}

/// A running sensor, whatever its type.
pub trait Source: Send {
    /// Its path.
    fn path(&self) -> &'static str;
    /// When it wants to be read first, if it says so.
    fn starts_at(&self) -> Option<MonotonicTime>;
    /// Lets it begin: it is due at once, or when it wants to be.
    fn begin(&mut self);
    /// When it is to be read next; none before it has begun and once it has finished.
    fn due(&self) -> Option<MonotonicTime>;
    /// Reads it and publishes the reading; all estimators downstream run before this returns.
    fn fire(&mut self);
    /// Closes the device.
    fn terminate(&mut self);
}

/// Beyond it a real sensor's next reading is a mistake: a day.
const FARTHEST_NANOS: i64 = 86_400_000_000_000;

/// Readings at one instant of virtual time before the sensor is taken to be stuck.
const STUCK_AFTER: u32 = 1_000_000;

struct Running<R: Robot, S: Sensor, P> {
    /// None once it has stopped.
    sensor: Option<S>,
    declaration: &'static SensorDeclaration,
    startup: Startup,
    wiring: Arc<R::Wiring>,
    publish: P,
    due: Option<MonotonicTime>,
    at_one_instant: u32,
}

impl Startup {
    /// Opens the sensor and adds it to `sources`; its readings go to `publish`.
    ///
    /// The wiring comes beside the function instead of in a closure: that it may go to another thread is known of every
    /// robot, and need not be proven anew for each of its sensors.
    pub fn source<R: Robot, S: Sensor>(
        &self,
        declaration: &'static SensorDeclaration,
        options: &S::Options,
        wiring: &Arc<R::Wiring>,
        publish: impl Fn(&R::Wiring, &Stamped<S::Output>) + Send + 'static,
        sources: &mut Vec<Box<dyn Source>>,
    ) {
        let context =
            SensorContext { robot: self.robot(), declaration, clock: self.clock.clone(), stop: self.stop.clone() };
        if let Some(sensor) = self.make(declaration.path, options, |options| S::init(options, &context)) {
            sources.push(Box::new(Running::<R, S, _> {
                sensor: Some(sensor),
                declaration,
                startup: self.clone(),
                wiring: Arc::clone(wiring),
                publish,
                due: None,
                at_one_instant: 0,
            }));
        }
    }
}

impl<R: Robot, S: Sensor, P: Fn(&R::Wiring, &Stamped<S::Output>) + Send> Running<R, S, P> {
    /// Reads the sensor once, publishes what it gave, and says when to read it next.
    fn read(&mut self, due: MonotonicTime) -> Result<Option<MonotonicTime>, Fault> {
        let Some(sensor) = &mut self.sensor else { return Ok(None) };
        let mut reading = sensor.read(self.startup.clock.now())?;
        let now = self.startup.clock.now();
        if let Some(payload) = reading.payload.take() {
            let monotonic_time = reading.time.unwrap_or(now);
            let stamp = Stamp {
                monotonic_time,
                wall_time: self.startup.clock.wall_at(monotonic_time),
                frame: self.declaration.frame,
                origin: self.startup.origin,
            };
            (self.publish)(&self.wiring, &stamp.message(payload));
        }
        self.next_due(reading.next, due, now)
    }

    /// When to read next after a reading that was due at `due`.
    fn next_due(
        &mut self,
        next: Next,
        due: MonotonicTime,
        now: MonotonicTime,
    ) -> Result<Option<MonotonicTime>, Fault> {
        let is_virtual = self.startup.clock.is_virtual();
        let next = match (next, self.declaration.period_nanos) {
            (Next::Never, _) => return Ok(None),
            (Next::At(time), _) if !is_virtual && time.nanos_since(now) > FARTHEST_NANOS => {
                return Err(Fault::new(format!(
                    "it asks to be read at {time}, and now is {now}; a recording with stamps of its own needs virtual \
                     time, `simulate`"
                )));
            }
            (Next::At(time), _) => time.max(due),
            (Next::AtRate, Some(period)) => next_on_grid(due, period, now),
            (Next::AtRate, None) if !is_virtual => now,
            (Next::AtRate, None) => {
                return Err(Fault::new(
                    "it has no `rate` and did not say when to read it next, so virtual time cannot go on; declare \
                     `rate`, or return `Reading::next_at`",
                ));
            }
        };
        self.at_one_instant = if next > due { 0 } else { self.at_one_instant.saturating_add(1) };
        if is_virtual && self.at_one_instant > STUCK_AFTER {
            return Err(Fault::new(format!("it asked {STUCK_AFTER} times to be read at {due}")));
        }
        Ok(Some(next))
    }

    /// Closes the device and drops the sensor.
    fn retire(&mut self, panicked: bool) {
        self.due = None;
        if let Some(fault) = self.sensor.take().and_then(|sensor| retire(sensor, panicked, S::terminate)) {
            self.startup.faults.add(self.declaration.path, fault.to_string());
        }
    }
}

/// The first time after `due` that is a whole number of periods later and not yet over: a sensor that has fallen behind
/// skips what it has missed and keeps its phase.
fn next_on_grid(due: MonotonicTime, period: i64, now: MonotonicTime) -> MonotonicTime {
    let missed = now.nanos_since(due).max(0) / period.max(1);
    let next = due.plus_nanos(period.saturating_mul(missed.max(1)));
    if next < now { next.plus_nanos(period) } else { next }
}

impl<R: Robot, S: Sensor, P: Fn(&R::Wiring, &Stamped<S::Output>) + Send> Source for Running<R, S, P> {
    fn path(&self) -> &'static str {
        self.declaration.path
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.sensor.as_ref().and_then(S::starts_at)
    }

    fn begin(&mut self) {
        let now = self.startup.clock.now();
        match self.next_due(Next::At(self.starts_at().unwrap_or(now)), MonotonicTime::from_nanos(i64::MIN), now) {
            Ok(due) => self.due = due,
            Err(fault) => self.startup.faults.add(self.declaration.path, fault.to_string()),
        }
    }

    fn due(&self) -> Option<MonotonicTime> {
        self.due
    }

    fn fire(&mut self) {
        let Some(due) = self.due else { return };
        match caught(|| self.read(due)) {
            Ok(next) => self.due = next,
            Err(Failed { fault, panicked }) => {
                self.startup.faults.add(self.declaration.path, fault.to_string());
                self.retire(panicked);
            }
        }
    }

    fn terminate(&mut self) {
        self.retire(false);
    }
}

impl<R: Robot, S: Sensor, P> Drop for Running<R, S, P> {
    /// Of a robot that did not start.
    fn drop(&mut self) {
        if let Some(sensor) = self.sensor.take() {
            let _ = retire(sensor, false, S::terminate);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_sensor_keeps_its_phase() {
        let next = |due, now| {
            let at = MonotonicTime::from_nanos;
            next_on_grid(at(due), 10, at(now)).as_nanos()
        };
        assert_eq!([next(0, 0), next(0, 3), next(0, 10), next(0, 11), next(0, 145)], [10, 10, 10, 20, 150]);
        assert_eq!(next(i64::MAX - 1, i64::MAX), i64::MAX);
    }
}
