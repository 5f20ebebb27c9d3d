//! What is called at a rate, or whenever it wants to be: sensors, controllers, bridges. When each is called, what becomes
//! of what it gives, and of itself when it fails.

use super::periodic::Periodic;
use super::supervision::{Failures, Supervisor};
use super::{Failed, Robot, Startup, caught, retire};
use crate::component::{Fault, Next, Then};
use crate::control::Binding;
use crate::message::{Frame, Stamp, Stamped};
use crate::time::MonotonicTime;
use crate::topology::Transform;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A sensor, a controller or a bridge as declared.
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
    /// The number of its supervisor.
    pub supervisor: Supervisor,
}

/// A running sensor or service, whatever its type.
pub trait Source: Send {
    /// Its path.
    fn path(&self) -> &'static str;
    /// When it wants to be read first, if it says so.
    fn starts_at(&self) -> Option<MonotonicTime>;
    /// Lets it begin: it is due at once, or when it wants to be.
    fn begin(&mut self);
    /// When it is to be read next, or started anew; none before it has begun and once it has finished.
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

struct Running<R: Robot, S: Periodic, P> {
    /// None while it does not run.
    component: Option<S>,
    context: S::Context,
    declaration: &'static SensorDeclaration,
    options: S::Options,
    binding: Binding<S::Options>,
    startup: Startup,
    wiring: Arc<R::Wiring>,
    publish: P,
    due: Option<MonotonicTime>,
    at_one_instant: u32,
    failures: Failures,
    restart: Arc<AtomicBool>,
    options_changed: Arc<AtomicBool>,
}

impl Startup {
    /// Makes a sensor or a service and adds it to `sources`; its readings go to `publish`.
    ///
    /// The wiring comes beside the function instead of in a closure: that it may go to another thread is known of every
    /// robot, and need not be proven anew for each of its sensors.
    pub fn source<R: Robot, S: Periodic>(
        &self,
        declaration: &'static SensorDeclaration,
        options: &S::Options,
        binding: Binding<S::Options>,
        wiring: &Arc<R::Wiring>,
        publish: impl Fn(&R::Wiring, &Stamped<S::Output>, MonotonicTime) + Send + 'static,
        sources: &mut Vec<Box<dyn Source>>,
    ) {
        let context = S::context(declaration, self);
        let made = self.make(declaration.path, options, binding, |options| S::init(options, &context));
        let Ok(component) = made else { return };
        let options_changed = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&options_changed);
        self.bind(declaration.path, options, binding, move || flag.store(true, Ordering::Release));
        sources.push(Box::new(Running::<R, S, _> {
            component: Some(component),
            context,
            declaration,
            options: options.clone(),
            binding,
            startup: self.clone(),
            wiring: Arc::clone(wiring),
            publish,
            due: None,
            at_one_instant: 0,
            failures: Failures::default(),
            restart: self.look_after(declaration.supervisor),
            options_changed,
        }));
    }
}

impl<R, S, P> Running<R, S, P>
where
    R: Robot,
    S: Periodic,
    P: Fn(&R::Wiring, &Stamped<S::Output>, MonotonicTime) + Send,
{
    /// Reads it once, publishes what it gave, and says when to read it next.
    fn read(&mut self, due: MonotonicTime) -> Result<Option<MonotonicTime>, Fault> {
        if self.options_changed.load(Ordering::Relaxed) && self.options_changed.swap(false, Ordering::AcqRel) {
            let options = self.startup.bound(&self.options, self.binding)?;
            if let Some(component) = &mut self.component {
                let path = self.declaration.path;
                let change = || component.handle_options(options, &self.context);
                self.startup.control.replacing_hooks(path, false, change)?;
            }
        }
        let Some(component) = &mut self.component else { return Ok(None) };
        let mut reading = component.read(self.startup.clock.now())?;
        let now = self.startup.clock.now();
        if let Some(payload) = reading.payload.take() {
            let monotonic_time = reading.time.unwrap_or(now);
            let stamp = Stamp {
                monotonic_time,
                wall_time: self.startup.clock.wall_at(monotonic_time),
                frame: self.declaration.frame,
                origin: self.startup.origin,
            };
            (self.publish)(&self.wiring, &stamp.message(payload), now);
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
            (Next::Never, _) | (Next::At(MonotonicTime::MAX), _) => return Ok(None),
            (Next::At(time), _) if !is_virtual && time.nanos_since(now) > FARTHEST_NANOS => {
                return Err(Fault::permanent(format!(
                    "it asks to be read at {time}, and now is {now}; a recording with stamps of its own needs virtual \
                     time, `simulate`"
                )));
            }
            (Next::At(time), _) => time.max(due),
            (Next::AtRate, Some(period)) => next_on_grid(due, period, now),
            (Next::AtRate, None) if !is_virtual => now,
            (Next::AtRate, None) => {
                return Err(Fault::permanent(
                    "it has no `rate` and did not say when to read it next, so virtual time cannot go on; declare \
                     `rate`, or return `Reading::next_at`",
                ));
            }
        };
        self.at_one_instant = if next > due { 0 } else { self.at_one_instant.saturating_add(1) };
        if is_virtual && self.at_one_instant > STUCK_AFTER {
            return Err(Fault::permanent(format!("it asked {STUCK_AFTER} times to be read at {due}")));
        }
        Ok(Some(next))
    }

    fn fail(&mut self, Failed { fault, panicked }: Failed) {
        self.startup.fault(self.declaration.path, &fault);
        self.retire(panicked);
        if fault.then != Then::Restart {
            return;
        }
        let now = self.startup.clock.now();
        let SensorDeclaration { supervisor, path, .. } = *self.declaration;
        self.due = self.startup.failed(&mut self.failures, supervisor, path, now, true);
        // The verdict may have flagged this one as well, which starts anew already.
        self.restart.store(false, Ordering::Release);
    }

    fn make_anew(&mut self) {
        let made = self.startup.bound(&self.options, self.binding);
        let made = match made {
            Ok(options) => {
                let make = || caught(|| S::init(options, &self.context));
                self.startup.control.replacing_hooks(self.declaration.path, true, make)
            }
            Err(fault) => Err(Failed { fault, panicked: false }),
        };
        match made {
            Ok(component) => {
                tracing::info!(component = self.declaration.path, "started anew");
                self.component = Some(component);
                self.begin();
            }
            Err(failed) => self.fail(failed),
        }
    }

    /// Closes the device and drops the component.
    fn retire(&mut self, panicked: bool) {
        self.due = None;
        if let Some(fault) = self.component.take().and_then(|component| retire(component, panicked, S::terminate)) {
            self.startup.fault(self.declaration.path, &fault);
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

impl<R, S, P> Source for Running<R, S, P>
where
    R: Robot,
    S: Periodic,
    P: Fn(&R::Wiring, &Stamped<S::Output>, MonotonicTime) + Send,
{
    fn path(&self) -> &'static str {
        self.declaration.path
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        self.component.as_ref().and_then(S::starts_at)
    }

    fn begin(&mut self) {
        let now = self.startup.clock.now();
        match self.next_due(Next::At(self.starts_at().unwrap_or(now)), MonotonicTime::from_nanos(i64::MIN), now) {
            Ok(due) => self.due = due,
            Err(fault) => self.fail(Failed { fault, panicked: false }),
        }
    }

    fn due(&self) -> Option<MonotonicTime> {
        self.due
    }

    fn fire(&mut self) {
        let Some(due) = self.due else { return };
        if self.component.is_some() && self.restart.swap(false, Ordering::AcqRel) {
            self.retire(false);
        }
        if self.component.is_none() {
            return self.make_anew();
        }
        match caught(|| self.read(due)) {
            Ok(next) => self.due = next,
            Err(failed) => self.fail(failed),
        }
    }

    fn terminate(&mut self) {
        self.retire(false);
    }
}

impl<R: Robot, S: Periodic, P> Drop for Running<R, S, P> {
    /// Of a robot that did not start.
    fn drop(&mut self) {
        if let Some(component) = self.component.take() {
            let _ = retire(component, false, S::terminate);
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
