//! Sensors, controllers and bridges, which are called at a rate or at the times they ask for: when each is called,
//! where its readings go, and how it is restarted.

use super::Robot;
use super::occupied::{Entered, Occupied};
use crate::component::{Binding, Next};
use crate::control::{ComponentOrder, Control};
use crate::declaration::SensorDeclaration;
use crate::fault::{Failed, Fault, Then, caught};
use crate::lifecycle::{AfterFault, HostHandle, Periodic, Recipe, Slot};
use crate::message::{Stamp, Stamped};
use crate::node::{BindTarget, Environment, blame};
use crate::time::{Clock, MonotonicTime};
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::Thread;

/// Shared state from which components are created.
#[derive(Clone, Debug)]
pub struct Assembly {
    pub(super) environment: Environment,
    pub(super) control: Control,
    pub(super) host: HostHandle,
}

impl Assembly {
    /// What all islands share.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }
}

/// A running sensor or service, whatever its type.
pub trait Source: Send {
    /// Its path.
    fn path(&self) -> &'static str;
    /// When it wants its first reading, if it says so.
    fn starts_at(&mut self) -> Option<MonotonicTime>;
    /// Starts it: its first reading is due at once, or at the time it asks for.
    fn begin(&mut self);
    /// When it is read or restarted next; `None` before it has begun and after it has finished.
    fn due(&self) -> Option<MonotonicTime>;
    /// Carries out orders of its supervisor and changes of parameters.
    fn obey(&mut self);
    /// Reads it and publishes the reading; all estimators downstream run before this returns.
    fn fire(&mut self);
    /// Closes the device.
    fn terminate(&mut self);
    /// Its state shared with other threads.
    #[doc(hidden)]
    fn shared(&self) -> SharedSource;
}

/// The part of a source that other threads reach. Clones share it.
#[derive(Clone, Debug)]
pub struct SharedSource(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    path: &'static str,
    /// Whether it is read at a rate; otherwise it may wait for its device.
    has_rate: bool,
    inbox: Mutex<Inbox>,
    readings: AtomicU64,
    skipped: AtomicU64,
    restarts: AtomicU64,
    occupied: Occupied,
    stopped: Mutex<Option<String>>,
}

#[derive(Debug, Default)]
struct Inbox {
    /// Each kind at most once.
    orders: Vec<Order>,
    thread: Option<Thread>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Options,
    Restart,
    GiveUp,
}

/// What a sensor or a service has done since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SourceStatistics {
    /// Its path.
    pub path: &'static str,
    /// How often it was read.
    pub readings: u64,
    /// Readings at its rate that it missed because it, or a component downstream, took too long.
    pub skipped: u64,
    /// How often it was restarted.
    pub restarts: u64,
    /// Why it does not run, if it does not.
    pub stopped: Option<String>,
}

impl SharedSource {
    fn new(path: &'static str, has_rate: bool) -> Self {
        Self(Arc::new(Shared {
            path,
            has_rate,
            inbox: Mutex::default(),
            readings: AtomicU64::new(0),
            skipped: AtomicU64::new(0),
            restarts: AtomicU64::new(0),
            occupied: Occupied::new(),
            stopped: Mutex::default(),
        }))
    }

    fn tell(&self, order: Order) {
        let mut inbox = lock(&self.0.inbox);
        if !inbox.orders.contains(&order) {
            inbox.orders.push(order);
        }
        if let Some(thread) = &inbox.thread {
            thread.unpark();
        }
    }

    fn take_orders(&self) -> Vec<Order> {
        std::mem::take(&mut lock(&self.0.inbox).orders)
    }

    /// The calling thread reads it from now on.
    pub(super) fn adopt(&self) {
        lock(&self.0.inbox).thread = Some(std::thread::current());
    }

    pub(super) fn path(&self) -> &'static str {
        self.0.path
    }

    pub(super) fn has_rate(&self) -> bool {
        self.0.has_rate
    }

    /// When its code was entered, if it is inside.
    pub(super) fn entered_at(&self) -> Option<MonotonicTime> {
        self.0.occupied.entered_at()
    }

    fn enter(&self, clock: &Clock) -> Entered<'_> {
        self.0.occupied.enter(clock)
    }

    pub(super) fn statistics(&self) -> SourceStatistics {
        SourceStatistics {
            path: self.0.path,
            readings: self.0.readings.load(Ordering::Relaxed),
            skipped: self.0.skipped.load(Ordering::Relaxed),
            restarts: self.0.restarts.load(Ordering::Relaxed),
            stopped: lock(&self.0.stopped).clone(),
        }
    }
}

/// A next reading of a real sensor further ahead is a mistake: a day.
const FARTHEST_NANOS: i64 = 86_400_000_000_000;

/// Readings at one instant of virtual time before the sensor is taken to be stuck.
const STUCK_AFTER: u32 = 1_000_000;

struct Running<R: Robot, S: Periodic, P> {
    slot: Slot<S>,
    context: S::Context,
    declaration: &'static SensorDeclaration,
    control: Control,
    environment: Environment,
    wiring: Arc<R::Wiring>,
    publish: P,
    shared: SharedSource,
    due: Option<MonotonicTime>,
    at_one_instant: u32,
}

impl Assembly {
    /// Makes a sensor or a service and adds it to `sources`; its readings go to `publish`.
    ///
    /// The wiring is passed beside the function instead of in a closure. That the wiring is `Send` is known for every
    /// robot, and need not be proven again for each of its sensors.
    pub fn source<R: Robot, S: Periodic>(
        &self,
        declaration: &'static SensorDeclaration,
        options: &S::Options,
        binding: Binding<S::Options>,
        wiring: &Arc<R::Wiring>,
        publish: impl Fn(&R::Wiring, &Stamped<S::Output>, MonotonicTime) + Send + 'static,
        sources: &mut Vec<Box<dyn Source>>,
    ) {
        let context = S::context(declaration, self.host.clone());
        let mut slot = Slot::<S>::new(Recipe::new(options, binding), self.environment.supervision());
        let parameters = self.control.parameters();
        let made = self.environment.make(declaration.path, || {
            let made = self.control.replacing_hooks(declaration.path, true, || slot.make(&context, &parameters));
            made.map_err(|failed| failed.fault)
        });
        if made.is_err() {
            return;
        }
        let shared = SharedSource::new(declaration.path, declaration.period_nanos.is_some());
        let tell = {
            let (told, control) = (shared.clone(), self.control.downgrade());
            move |order| {
                told.tell(order);
                if let Some(control) = control.upgrade() {
                    control.note_order();
                }
            }
        };
        let told = tell.clone();
        let target = BindTarget::Other(Box::new(move || told(Order::Options)));
        self.environment.bind(declaration.path, options, binding, target);
        self.control.look_after(declaration.path, declaration.supervisor, move |order| {
            tell(match order {
                ComponentOrder::Restart => Order::Restart,
                ComponentOrder::GiveUp => Order::GiveUp,
            });
        });
        sources.push(Box::new(Running::<R, S, _> {
            slot,
            context,
            declaration,
            control: self.control.clone(),
            environment: self.environment.clone(),
            wiring: Arc::clone(wiring),
            publish,
            shared,
            due: None,
            at_one_instant: 0,
        }));
    }
}

impl<R, S, P> Running<R, S, P>
where
    R: Robot,
    S: Periodic,
    P: Fn(&R::Wiring, &Stamped<S::Output>, MonotonicTime) + Send,
{
    fn clock(&self) -> &Clock {
        self.environment.clock()
    }

    /// Reads it once, publishes the reading, and says when to read it next; `next` is set to the time it asked for.
    fn read(&mut self, due: MonotonicTime, next: &mut Next) -> Result<Option<MonotonicTime>, Fault> {
        let now = self.clock().now();
        let Some(component) = self.slot.running() else { return Ok(None) };
        self.shared.0.readings.fetch_add(1, Ordering::Relaxed);
        let mut reading = {
            let _entered = self.shared.enter(self.environment.clock());
            component.read(now)?
        };
        let now = self.clock().now();
        if let Some(payload) = reading.payload.take() {
            let monotonic_time = reading.time.unwrap_or(now);
            let stamp = Stamp {
                monotonic_time,
                wall_time: self.clock().wall_at(monotonic_time),
                frame: self.declaration.frame,
                origin: self.environment.origin(),
            };
            *next = reading.next;
            // A source left running may return after the robot has stopped.
            if let Some(_inside) = self.environment.door().enter() {
                (self.publish)(&self.wiring, &stamp.message(payload), now);
            }
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
                self.shared.0.skipped.fetch_add(skipped, Ordering::Relaxed);
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
        *lock(&self.shared.0.stopped) = Some(message.clone());
        self.due = match self.slot.fail(&failed, self.environment.clock().now()) {
            AfterFault::RestartAt(at) => Some(at),
            AfterFault::Stopped => None,
        };
        if failed.fault.then == Then::Skip {
            tracing::info!(component = path, message, "left out");
            return;
        }
        self.control.component_failed(path, supervisor, message, failed.panicked);
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
                tracing::info!(component = path, "restarted");
                self.shared.0.restarts.fetch_add(1, Ordering::Relaxed);
                *lock(&self.shared.0.stopped) = None;
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
            Ok(false) => self.restart(),
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

impl<R, S, P> Source for Running<R, S, P>
where
    R: Robot,
    S: Periodic,
    P: Fn(&R::Wiring, &Stamped<S::Output>, MonotonicTime) + Send,
{
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
                Order::Restart => {
                    if self.slot.restart(self.clock().now()) {
                        self.restart();
                    }
                }
                Order::GiveUp => {
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
        let read = match caught(|| self.read(due, &mut next)) {
            Ok(read) => Ok(read),
            // If somebody else's code has failed, the source has still given its reading.
            Err(failed) => blame(&self.environment, failed)
                .and_then(|()| self.next_due(next, due, self.clock().now()).map_err(Failed::from)),
        };
        match read {
            Ok(next) => self.due = next,
            Err(failed) => self.fail(failed),
        }
    }

    fn terminate(&mut self) {
        self.due = None;
        let fault = {
            let _entered = self.shared.enter(self.environment.clock());
            self.slot.retire()
        };
        if let Some(fault) = fault {
            self.control.note_fault(self.declaration.path, fault.to_string());
        }
    }

    fn shared(&self) -> SharedSource {
        self.shared.clone()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl fmt::Debug for dyn Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Source").field(&self.path()).finish()
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
