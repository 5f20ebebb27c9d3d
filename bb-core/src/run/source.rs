//! A running sensor: when it is read, and what becomes of a reading.

use super::{StartError, Startup, caught};
use crate::component::{Fault, Next, Options, Reading, Sensor, SensorContext};
use crate::message::{Frame, Stamp, Stamped};
use crate::time::MonotonicTime;
use crate::topology::Transform;

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
    /// When it is to be read next; none once it has finished.
    fn due(&self) -> Option<MonotonicTime>;
    /// Reads it and publishes the reading; all estimators downstream run before this returns.
    fn fire(&mut self);
    /// Closes the device.
    fn terminate(&mut self);
}

/// Readings at one instant of virtual time before the sensor is taken to be stuck.
const STUCK_AFTER: u32 = 1_000_000;

struct Running<S, P> {
    sensor: S,
    declaration: &'static SensorDeclaration,
    startup: Startup,
    publish: P,
    due: Option<MonotonicTime>,
    at_one_instant: u32,
}

impl Startup {
    /// Validates the options and opens the sensor; its readings go to `publish`.
    ///
    /// # Errors
    /// Names the sensor and what keeps it from starting.
    pub fn source<S: Sensor>(
        &self,
        declaration: &'static SensorDeclaration,
        options: S::Options,
        publish: impl Fn(&Stamped<S::Output>) + Send + 'static,
    ) -> Result<Box<dyn Source>, StartError> {
        let refused = |fault: Fault| StartError::component(declaration.path, fault);
        options.validate().map_err(|message| refused(Fault::new(message)))?;
        let context =
            SensorContext { robot: self.robot(), declaration, clock: self.clock.clone(), stop: self.stop.clone() };
        let sensor = caught(|| S::init(options, &context)).map_err(refused)?;
        let due = Some(self.clock.now());
        let startup = self.clone();
        Ok(Box::new(Running { sensor, declaration, startup, publish, due, at_one_instant: 0 }))
    }
}

impl<S: Sensor, P: Fn(&Stamped<S::Output>) + Send> Running<S, P> {
    fn publish(&self, reading: &mut Reading<S::Output>, now: MonotonicTime) {
        let Some(payload) = reading.payload.take() else {
            return;
        };
        let monotonic_time = reading.time.unwrap_or(now);
        let stamp = Stamp {
            monotonic_time,
            wall_time: self.startup.clock.wall_at(monotonic_time),
            frame: self.declaration.frame,
            origin: self.startup.origin,
        };
        (self.publish)(&stamp.message(payload));
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
            (Next::At(time), _) => time.max(due),
            // A sensor that has fallen behind skips what it has missed instead of hurrying after it.
            (Next::AtRate, Some(period)) => due.plus_nanos(period).max(now),
            (Next::AtRate, None) if !is_virtual => now,
            (Next::AtRate, None) => {
                return Err(Fault::new(
                    "it has no `rate` and did not say when to read it next, so virtual time cannot go on; declare \
                     `rate`, or return `Reading::next_at`",
                ));
            }
        };
        self.at_one_instant = if next > due { 0 } else { self.at_one_instant + 1 };
        if is_virtual && self.at_one_instant > STUCK_AFTER {
            return Err(Fault::new(format!("it asked {STUCK_AFTER} times to be read at {due}")));
        }
        Ok(Some(next))
    }
}

impl<S: Sensor, P: Fn(&Stamped<S::Output>) + Send> Source for Running<S, P> {
    fn path(&self) -> &'static str {
        self.declaration.path
    }

    fn due(&self) -> Option<MonotonicTime> {
        self.due
    }

    fn fire(&mut self) {
        let Some(due) = self.due else { return };
        let called = self.startup.clock.now();
        let next = caught(|| self.sensor.read(called)).and_then(|mut reading| {
            let now = self.startup.clock.now();
            self.publish(&mut reading, now);
            self.next_due(reading.next, due, now)
        });
        self.due = next.unwrap_or_else(|fault| {
            self.startup.faults.add(self.declaration.path, fault.to_string());
            None
        });
    }

    fn terminate(&mut self) {
        self.due = None;
        let ended = caught(|| {
            self.sensor.terminate();
            Ok(())
        });
        if let Err(fault) = ended {
            self.startup.faults.add(self.declaration.path, fault.to_string());
        }
    }
}
