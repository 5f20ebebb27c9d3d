//! Sensors, controllers and bridges, which are called at a rate or at the times they ask for: when each is called,
//! where its readings go, and how it is restarted.

mod shared;

pub use self::shared::SourceStatistics;
pub(super) use self::shared::{Order, SharedSource};
use crate::component::{Binding, ExternalSensor, Host, Next, OptionsList, Sensor, SensorContext};
use crate::control::{ComponentOrder, Control};
use crate::declaration::SensorDeclaration;
use crate::fault::{Failed, Fault, Termination, Then, caught};
use crate::lifecycle::{AfterFault, AsSensor, Recipe, Slot};
use crate::message::{Payload as _, Stamped};
use crate::node::{BindTarget, Environment};
use crate::pubsub::{DynamicMessage, Enter};
use crate::time::{Clock, MonotonicTime};
use bb_message::__private::Sorted;
use std::sync::Arc;

/// Shared state from which components are created.
#[derive(Clone, Debug)]
pub struct Assembly {
    pub(super) environment: Environment,
    pub(super) control: Control,
    pub(super) host: Arc<dyn Host>,
}

impl Assembly {
    /// Returns the state that all islands share.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }
}

/// A running sensor or service, whatever its type.
pub(crate) trait Source: Send {
    /// Returns the path of the component.
    fn path(&self) -> &'static str;
    /// The time of its first reading, if it asks for one.
    fn starts_at(&mut self) -> Option<MonotonicTime>;
    /// Starts it: its first reading is due at once, or at the time it asks for.
    fn begin(&mut self);
    /// Returns the time of the next reading or restart; `None` before it has begun and after it has finished.
    fn due(&self) -> Option<MonotonicTime>;
    /// Carries out orders of its supervisor and changes of parameters.
    fn obey(&mut self);
    /// Reads it and publishes the reading; all estimators downstream run before this returns.
    fn fire(&mut self);
    /// Closes the device.
    fn terminate(&mut self);
    /// Returns the state shared with other threads.
    #[doc(hidden)]
    fn shared(&self) -> SharedSource;
}

/// Sensors and services that have been made, in the order in which they are read.
pub(super) type OpenSources = Vec<Box<dyn Source>>;

/// A next reading of a real sensor further ahead is a mistake: a day.
const FARTHEST_NANOS: i64 = 86_400_000_000_000;

/// Readings at one instant of virtual time before the sensor is taken to be stuck.
const STUCK_AFTER: u32 = 1_000_000;

struct Running<S: Sensor> {
    slot: Slot<AsSensor<S>>,
    context: SensorContext,
    declaration: &'static SensorDeclaration,
    control: Control,
    environment: Environment,
    publish: Publish<S::Output>,
    shared: SharedSource,
    due: Option<MonotonicTime>,
    at_one_instant: u32,
}

/// Publishes a reading and runs everything downstream.
type Publish<T> = Arc<Enter<T>>;

/// The sensors and services of a robot before they are made, in the order in which they are opened.
#[allow(missing_debug_implementations)]
#[derive(Default)]
pub struct Sources(Vec<Box<dyn AnySource>>);

impl Sources {
    /// Adds one; its readings go to `publish`. `component` is the number of its options, and `publisher` that of its topic.
    pub fn add<S: Sensor, W: Send + Sync + 'static>(
        &mut self,
        wiring: &Arc<W>,
        declaration: &'static SensorDeclaration,
        component: usize,
        publisher: usize,
        binding: Binding<S::Options>,
        publish: fn(&W, &Stamped<S::Output>, MonotonicTime),
    ) {
        let wiring = Arc::clone(wiring);
        let publish: Publish<S::Output> = Arc::new(move |message, now| publish(&wiring, message, now));
        self.0.push(Box::new(OfType::<S> { declaration, component, publisher, binding, publish }));
    }

    /// Makes all of them.
    pub(super) fn open(&self, options: &OptionsList, assembly: &Assembly) -> OpenSources {
        self.0.iter().filter_map(|source| source.open(options, assembly)).collect()
    }

    /// Sensors whose messages other code publishes.
    pub(super) fn external(self) -> ExternalSensors {
        ExternalSensors(self.0.into_iter().filter(|source| source.is_external()).collect())
    }

    /// Returns the sources by the number of the publisher.
    pub(super) fn by_publisher(self) -> Sorted<usize, Box<dyn AnySource>> {
        let mut sources = Sorted::default();
        for source in self.0 {
            sources.insert(source.publisher(), source);
        }
        sources
    }
}

/// The sensors whose messages other code publishes.
pub(super) struct ExternalSensors(Vec<Box<dyn AnySource>>);

impl ExternalSensors {
    /// The one at `path`.
    pub(super) fn at(&self, path: &str) -> Option<ExternalSensor> {
        self.0.iter().map(|source| source.as_external()).find(|sensor| sensor.path == path)
    }

    pub(super) fn paths(&self) -> Vec<&'static str> {
        self.0.iter().map(|source| source.as_external().path).collect()
    }

    /// Publishes a message at its path.
    pub(super) fn enter(&self, message: &DynamicMessage, now: MonotonicTime) {
        if let Some(source) = self.0.iter().find(|source| source.as_external().path == message.path()) {
            source.feed(message, now);
        }
    }
}

/// A sensor or a service before it is made, whatever its type.
pub(super) trait AnySource: Send + Sync {
    /// The number of its publisher.
    fn publisher(&self) -> usize;
    /// Makes it; `None` if it cannot start, or is left out.
    fn open(&self, options: &OptionsList, assembly: &Assembly) -> Option<Box<dyn Source>>;
    /// Publishes a recorded message; returns `false` if it has another payload.
    fn feed(&self, message: &DynamicMessage, now: MonotonicTime) -> bool;
    /// Returns whether other code publishes its messages.
    fn is_external(&self) -> bool;
    /// Returns the source as that code sees it.
    fn as_external(&self) -> ExternalSensor;
}

struct OfType<S: Sensor> {
    declaration: &'static SensorDeclaration,
    component: usize,
    publisher: usize,
    binding: Binding<S::Options>,
    publish: Publish<S::Output>,
}

impl<S: Sensor> AnySource for OfType<S> {
    fn publisher(&self) -> usize {
        self.publisher
    }

    fn open(&self, options: &OptionsList, assembly: &Assembly) -> Option<Box<dyn Source>> {
        assembly.source::<S>(self.declaration, options.of(self.component), self.binding, &self.publish)
    }

    fn is_external(&self) -> bool {
        S::IS_EXTERNAL
    }

    fn as_external(&self) -> ExternalSensor {
        let SensorDeclaration { path, frame, .. } = *self.declaration;
        ExternalSensor { path, frame, payload: S::Output::NAME, enter: Box::new(Arc::downgrade(&self.publish)) }
    }

    fn feed(&self, message: &DynamicMessage, now: MonotonicTime) -> bool {
        message.downcast().map(|message| (self.publish)(message, now)).is_some()
    }
}

impl Assembly {
    /// Makes a sensor or a service; its readings go to `publish`.
    fn source<S: Sensor>(
        &self,
        declaration: &'static SensorDeclaration,
        options: &S::Options,
        binding: Binding<S::Options>,
        publish: &Publish<S::Output>,
    ) -> Option<Box<dyn Source>> {
        let context = SensorContext::new(declaration, Arc::clone(&self.host));
        let shared =
            SharedSource::new(declaration.path, declaration.period_nanos.is_some(), context.counters().clone());
        let tell = {
            let (source, control) = (shared.clone(), self.control.downgrade());
            move |order| {
                source.tell(order);
                if let Some(control) = control.upgrade() {
                    control.note_order();
                }
            }
        };
        let tell_of_options = tell.clone();
        let target = BindTarget::Other(Box::new(move || tell_of_options(Order::Options)));
        self.environment.bind(declaration.path, options, binding, target);
        let mut slot = Slot::<AsSensor<S>>::new(Recipe::new(options, binding), self.environment.supervision());
        let parameters = self.control.parameters();
        let made = self.environment.make(declaration.path, || {
            let made = self.control.replacing_hooks(declaration.path, true, || slot.make(&context, &parameters));
            made.map_err(|failed| failed.fault)
        });
        if made.is_err() {
            return None;
        }
        self.control.supervise(declaration.path, declaration.supervisor, move |order| {
            tell(Order::Supervisor(order));
        });
        Some(Box::new(Running::<S> {
            slot,
            context,
            declaration,
            control: self.control.clone(),
            environment: self.environment.clone(),
            publish: Arc::clone(publish),
            shared,
            due: None,
            at_one_instant: 0,
        }))
    }
}

impl<S: Sensor> Running<S> {
    fn clock(&self) -> &Clock {
        self.environment.clock()
    }

    /// Takes one reading, publishes it, and returns when to take the next one; `next` is set to the time it asked for.
    fn read(&mut self, due: MonotonicTime, next: &mut Next) -> Result<Option<MonotonicTime>, Fault> {
        let now = self.clock().now();
        let Some(component) = self.slot.running() else { return Ok(None) };
        self.shared.count_reading();
        let mut reading = {
            let _entered = self.shared.enter(self.environment.clock());
            component.read(now)?
        };
        let now = self.clock().now();
        if let Some(payload) = reading.payload.take() {
            let stamp = self.environment.stamp(reading.time.unwrap_or(now), self.declaration.frame);
            *next = reading.next;
            // A source left running may return after the robot has stopped.
            if let Some(_inside) = self.environment.door().enter() {
                (self.publish)(&stamp.message(payload), now);
            }
        }
        self.next_due(reading.next, due, now)
    }

    /// Returns the time of the next reading after one that was due at `due`.
    fn next_due(
        &mut self,
        next: Next,
        due: MonotonicTime,
        now: MonotonicTime,
    ) -> Result<Option<MonotonicTime>, Fault> {
        let is_virtual = self.clock().is_virtual();
        let next = match (next, self.declaration.period_nanos) {
            (Next::Never, _) | (Next::At(MonotonicTime::MAX), _) => return Ok(None),
            (Next::At(time), _) if !is_virtual && time.nanos_since(now) > FARTHEST_NANOS => {
                return Err(Fault::permanent(format!(
                    "it asks to be read at {time}, and now is {now}; a recording with stamps of its own needs virtual \
                     time, `simulate`"
                )));
            }
            (Next::At(time), _) => time.max(due),
            (Next::AtRate, Some(period)) => {
                let (next, skipped) = next_on_grid(due, period, now);
                self.shared.count_skipped(skipped);
                next
            }
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

    fn fail(&mut self, failed: Failed) {
        let SensorDeclaration { path, supervisor, .. } = *self.declaration;
        let message = failed.fault.to_string();
        self.shared.note_stop(message.clone());
        self.due = match self.slot.fail(&failed, self.environment.clock().now()) {
            AfterFault::RestartAt(at) => Some(at),
            AfterFault::Stopped => None,
        };
        if failed.fault.then == Then::Skip {
            self.control.log(|| tracing::info!(component = path, message, "left out"));
            return;
        }
        self.shared.note_failure(self.environment.clock().now());
        self.control.component_failed(path, supervisor, message, failed.panicked);
    }

    /// Retires it and creates it again, though it has not failed.
    fn restart_from_above(&mut self, reason: Termination<'_>) {
        let was_running = {
            let _entered = self.shared.enter(self.environment.clock());
            self.slot.restart(self.environment.clock().now(), reason)
        };
        if was_running {
            self.restart();
        }
    }

    /// Creates it again; its first reading is due at once.
    fn restart(&mut self) {
        let path = self.declaration.path;
        let parameters = self.control.parameters();
        let (control, slot, context) = (&self.control, &mut self.slot, &self.context);
        let made = {
            let _entered = self.shared.enter(self.environment.clock());
            control.replacing_hooks(path, true, || slot.make(context, &parameters))
        };
        match made {
            Ok(()) => {
                self.control.log(|| tracing::info!(component = path, "restarted"));
                self.shared.note_restart();
                self.begin();
            }
            Err(failed) => self.fail(failed),
        }
    }

    fn change_options(&mut self) {
        let parameters = self.control.parameters();
        let (control, slot, context) = (&self.control, &mut self.slot, &self.context);
        let changed = {
            let _entered = self.shared.enter(self.environment.clock());
            control.replacing_hooks(self.declaration.path, false, || slot.change(context, &parameters))
        };
        match changed {
            Ok(true) => {}
            Ok(false) => self.restart_from_above(Termination::NewOptions),
            Err(failed) => self.fail(failed),
        }
    }
}

/// The first time in the future that is a whole number of periods after `due`, and how many periods were missed. A
/// sensor that has fallen behind skips these and keeps its phase.
fn next_on_grid(due: MonotonicTime, period: i64, now: MonotonicTime) -> (MonotonicTime, u64) {
    let period = period.max(1);
    let missed = now.nanos_since(due).max(0) / period;
    let next = due.plus_nanos(period.saturating_mul(missed.max(1)));
    let next = if next < now { next.plus_nanos(period) } else { next };
    (next, (next.nanos_since(due) / period - 1).max(0).unsigned_abs())
}

impl<S: Sensor> Source for Running<S> {
    fn path(&self) -> &'static str {
        self.declaration.path
    }

    fn starts_at(&mut self) -> Option<MonotonicTime> {
        let component = self.slot.running()?;
        match caught(|| Ok(component.starts_at())) {
            Ok(time) => time,
            Err(failed) => {
                self.fail(failed);
                None
            }
        }
    }

    fn begin(&mut self) {
        let now = self.clock().now();
        let first = self.starts_at().unwrap_or(now);
        if !self.slot.is_running() {
            return;
        }
        match self.next_due(Next::At(first), MonotonicTime::from_nanos(i64::MIN), now) {
            Ok(due) => self.due = due,
            Err(fault) => self.fail(Failed::from(fault)),
        }
    }

    fn due(&self) -> Option<MonotonicTime> {
        self.due
    }

    fn obey(&mut self) {
        for order in self.shared.take_orders() {
            match order {
                Order::Options => self.change_options(),
                Order::Supervisor(ComponentOrder::Restart) => self.restart_from_above(Termination::Supervisor),
                Order::Supervisor(ComponentOrder::GiveUp) => {
                    self.slot.give_up();
                    self.due = None;
                }
            }
        }
    }

    fn fire(&mut self) {
        self.obey();
        let Some(due) = self.due else { return };
        if let Some(at) = self.slot.restart_at() {
            if at <= self.clock().now() {
                self.restart();
            }
            return;
        }
        let mut next = Next::AtRate;
        match caught(|| self.read(due, &mut next)) {
            Ok(next) => self.due = next,
            Err(failed) => self.fail(failed),
        }
    }

    fn terminate(&mut self) {
        self.due = None;
        let fault = {
            let _entered = self.shared.enter(self.environment.clock());
            self.slot.retire(Termination::Stop)
        };
        if let Some(fault) = fault {
            self.control.note_fault(self.declaration.path, fault.to_string());
        }
    }

    fn shared(&self) -> SharedSource {
        self.shared.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_sensor_keeps_its_phase_and_counts_what_it_skipped() {
        let next = |due, now| {
            let at = MonotonicTime::from_nanos;
            let (next, skipped) = next_on_grid(at(due), 10, at(now));
            (next.as_nanos(), skipped)
        };
        assert_eq!([next(0, 0), next(0, 3), next(0, 10), next(0, 11)], [(10, 0), (10, 0), (10, 0), (20, 1)]);
        assert_eq!(next(0, 145), (150, 14));
        assert_eq!(next(i64::MAX - 1, i64::MAX).0, i64::MAX);
    }
}
