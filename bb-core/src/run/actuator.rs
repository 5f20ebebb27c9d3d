//! A running actuator: when it may move, and how its failures are handled.

mod held;
mod limits;
mod reports;

use self::held::{Guarded, Held};
pub use self::limits::ActuatorStatistics;
use self::limits::Counts;
use self::reports::Reports;
use super::occupied::Occupied;
use super::source::Assembly;
use crate::component::{Accepts, Actuator, ActuatorContext, ActuatorError, Binding, Permit};
use crate::control::{ComponentOrder, Control};
use crate::declaration::ActuatorDeclaration;
use crate::event::Safety;
use crate::fault::{Failed, Fault, caught, of_panic};
use crate::journal::{Event, Recorded};
use crate::lifecycle::{AfterFault, AsActuator, HostHandle, Recipe, Slot};
use crate::message::{Finite, Frame, Payload, Stamp, copied};
use crate::node::{BindTarget, Environment, Mode};
use crate::pubsub::{AnyTopic, DynamicMessage, Topic, Wakers};
use crate::schedule::Lane;
use crate::time::MonotonicTime;
use std::any::Any;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Wake, Waker};
use std::time::{Duration, Instant};

/// The least delay before an actuator that asks to be updated at once, or in the past, is updated.
const LEAST_PERIOD: Duration = Duration::from_micros(10);

/// An actuator in the wiring.
pub struct ActuatorNode<A: Actuator>(Arc<Inner<A>>);

struct Inner<A: Actuator> {
    this: Weak<Self>,
    number: usize,
    declaration: &'static ActuatorDeclaration,
    context: ActuatorContext,
    environment: Environment,
    control: Control,
    topic: Topic<A::Command>,
    /// Orders from its supervisor and parameter changes.
    orders: Mutex<Vec<Order>>,
    /// The time at which its code was entered.
    occupied: Occupied,
    counts: Counts,
    reports: Reports,
    host: HostHandle,
    /// Held while its code runs. Anything that must not wait for user code must not take this lock.
    state: Guarded<State<A>>,
}

struct State<A: Actuator> {
    slot: Slot<AsActuator<A>>,
    /// Whether it has failed and could not be made safe.
    is_unsafe: bool,
    /// The command execution that sent the last command to be carried out.
    moved_by: Permit,
    /// The update time that is currently set as an alarm.
    alarm: Option<MonotonicTime>,
    /// On virtual time: changes to report to the control state once the lock is released. Loggers, telemetry handlers and
    /// subscribers receive them on this thread and may disarm the robot, which takes the lock.
    told: Vec<Told>,
}

/// Changes to report to the control state.
enum Told {
    Failed { message: String, panicked: bool },
    Unsafe(String),
    MessageFailed(String),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Options,
    Restart,
    GiveUp,
}

impl<A: Actuator> ActuatorNode<A> {
    /// Creates the actuator; an error that prevents the robot from starting is stored in `assembly`.
    pub fn new(
        number: usize,
        declaration: &'static ActuatorDeclaration,
        options: &A::Options,
        binding: Binding<A::Options>,
        assembly: &Assembly,
    ) -> Self {
        let context = ActuatorContext::new(declaration, Arc::clone(&assembly.host.0));
        let environment = assembly.environment.clone();
        let control = assembly.control.clone();
        let mut slot = Slot::new(Recipe::new(options, binding), environment.supervision());
        // A replay moves nothing.
        if environment.mode() != Mode::Replay {
            let parameters = control.parameters();
            let _ = environment.make(declaration.path, || {
                let made = control.replacing_hooks(declaration.path, true, || slot.make(&context, &parameters));
                made.map_err(|failed| failed.fault)
            });
        }
        let inner = Arc::new_cyclic(|this| Inner {
            this: Weak::clone(this),
            number,
            declaration,
            context,
            environment,
            control,
            topic: Topic::new(declaration.path),
            orders: Mutex::default(),
            occupied: Occupied::new(),
            counts: Counts::default(),
            reports: Reports::default(),
            host: assembly.host.clone(),
            state: Guarded::new(State {
                slot,
                is_unsafe: false,
                moved_by: Permit::UNLIMITED,
                alarm: None,
                told: Vec::new(),
            }),
        });
        // Also in a replay: the topic decodes messages read from a file.
        if A::Command::COMMANDS_JOINT {
            inner.reports.announce(&inner.context, &*inner.host.0);
        }
        // The actuator may have work to do from the start.
        if inner.environment.mode() != Mode::Replay {
            inner.alone(|_| ());
        }
        // Weak, since the actuator owns the control state, which stores these callbacks.
        let told = Arc::downgrade(&inner);
        let target = BindTarget::Other(Box::new(move || Inner::tell(&told, Order::Options)));
        assembly.environment.bind(declaration.path, options, binding, target);
        let told = Arc::downgrade(&inner);
        assembly.control.look_after(declaration.path, declaration.supervisor, move |order| {
            Inner::tell(
                &told,
                match order {
                    ComponentOrder::Restart => Order::Restart,
                    ComponentOrder::GiveUp => Order::GiveUp,
                },
            );
        });
        let disarmed = Arc::downgrade(&inner);
        let disarm = move || disarmed.upgrade().map_or(Ok(()), |inner| inner.disarm());
        assembly.control.on_disarm_always(declaration.path, Arc::new(disarm));
        Self(inner)
    }

    /// The topic on which its commands are published.
    pub fn topic(&self) -> &Topic<A::Command> {
        &self.0.topic
    }

    /// Carries out a command from an outside caller.
    ///
    /// # Errors
    /// See [`ActuatorError`].
    pub fn send(&self, command: A::Command) -> Result<(), ActuatorError> {
        self.0.accept(command, &Permit::UNLIMITED)
    }
}

impl<A: Actuator> Accepts<A::Command> for Inner<A> {
    fn accept(&self, command: A::Command, permit: &Permit) -> Result<(), ActuatorError> {
        if !command.is_finite() {
            return Err(ActuatorError::NonFinite);
        }
        if let Some(journal) = self.environment.journal() {
            journal.wait_for_room();
        }
        let mut wakers = Wakers::default();
        let done = self.alone(|state| self.carry_out(state, command, permit, &mut wakers));
        wakers.run();
        done.unwrap_or(Err(ActuatorError::Inside))
    }

    fn stop_motion_of(&self, permit: &Permit) {
        let Some(stop) = A::Command::stop_command() else { return };
        let mut wakers = Wakers::default();
        self.alone(|state| {
            if state.moved_by.is_of_same(permit) {
                // Disarming has already stopped it, and a failing actuator is made safe.
                let _ = self.carry_out(state, stop, &Permit::UNLIMITED, &mut wakers);
            }
        });
        wakers.run();
    }
}

impl<A: Actuator> Inner<A> {
    /// Calls `run` while no other code of the actuator runs. Returns `None` if the caller is code of this actuator, or of another
    /// one that it waits for: the call would wait for itself.
    fn alone<T>(&self, run: impl FnOnce(&mut State<A>) -> T) -> Option<T> {
        let mut state = self.state.enter()?;
        let result = {
            // Disarming would also wait for this.
            let _within = self.control.enter_actuator();
            run(&mut state)
        };
        let mut wakers = Wakers::default();
        self.reports.publish(&self.context, &*self.host.0, &self.environment, &mut wakers);
        self.schedule_update(&mut state);
        let told = std::mem::take(&mut state.told);
        drop(state);
        wakers.run();
        told.into_iter().for_each(|told| self.tell_now(told));
        Some(result)
    }

    /// Schedules its next update.
    fn schedule_update(&self, state: &mut State<A>) {
        let Some(actuator) = state.slot.running() else { return };
        let Some(due) = actuator.next_update() else { return };
        // An update must not prevent virtual time from advancing.
        let due = due.max(self.environment.clock().now() + LEAST_PERIOD);
        if state.alarm.is_none_or(|alarm| due < alarm) {
            state.alarm = Some(due);
            self.control.wake_at(due, Waker::from(Arc::new(Due(Weak::clone(&self.this)))));
        }
    }

    fn update_if_due(&self, state: &mut State<A>, now: MonotonicTime) {
        state.alarm.take_if(|alarm| *alarm <= now);
        let Some(actuator) = state.slot.running() else { return };
        if actuator.next_update().is_none_or(|due| due > now) {
            return;
        }
        let updated = {
            let _entered = self.occupied.enter(self.environment.clock());
            caught(|| actuator.update(now))
        };
        if let Err(failed) = updated {
            self.fail(state, &failed, now);
        }
    }

    fn carry_out(
        &self,
        state: &mut State<A>,
        mut command: A::Command,
        permit: &Permit,
        wakers: &mut Wakers,
    ) -> Result<(), ActuatorError> {
        self.obey(state);
        // This lock is also taken by disarming: nothing moves after disarming has returned.
        let safety = self.control.safety_now();
        if safety != Safety::Armed {
            return Err(ActuatorError::NotArmed(safety));
        }
        if !permit.is_valid() {
            return Err(ActuatorError::Cancelled);
        }
        let clock = self.environment.clock();
        let now = clock.now();
        self.restart_if_due(state, now);
        let Some(actuator) = state.slot.running() else { return Err(ActuatorError::Stopped) };
        self.counts.limit(&mut command, &self.context, self.environment.joints())?;
        let stamp = Stamp {
            monotonic_time: now,
            wall_time: clock.wall_at(now),
            frame: Frame::new(self.declaration.joint),
            origin: self.environment.origin(),
        };
        let message = stamp.message(command);
        let handled = {
            let _entered = self.occupied.enter(clock);
            caught(|| actuator.handle_command(&message))
        };
        if let Err(failed) = handled {
            let text = failed.fault.to_string();
            self.fail(state, &failed, now);
            return Err(ActuatorError::Failed(text));
        }
        state.moved_by = permit.clone();
        self.counts.carried_out();
        let mut panic = None;
        if let Some(journal) = self.environment.journal()
            && let Some(copy) = copied(&message, &mut panic)
        {
            let message = Recorded::Message(DynamicMessage::of(self.declaration.path, copy));
            journal.write(now, clock.wall_offset_nanos(), Event::Actuated { actuator: self.number, message });
        }
        // Under the lock, so that messages keep the order in which commands are carried out.
        self.topic.publish_deferred(&message, wakers, &mut panic);
        if let Some(panic) = panic {
            // The actuator has moved: neither it nor the sender fails.
            self.tell_control(state, Told::MessageFailed(format!("its message {}", of_panic(panic))));
        }
        Ok(())
    }

    /// Called by the control state, which must not wait for the actuator's code.
    fn tell(this: &Weak<Self>, order: Order) {
        let Some(inner) = this.upgrade() else { return };
        let mut orders = lock(&inner.orders);
        if orders.contains(&order) {
            // It already waits for the actuator's code.
            return;
        }
        orders.push(order);
        drop(orders);
        match inner.environment.mode() {
            Mode::Real => {
                let pool = inner.environment.pool().clone();
                pool.submit(Lane::Robot, move || {
                    inner.alone(|state| inner.obey(state));
                });
            }
            Mode::Virtual => {
                let now = inner.environment.clock().now();
                inner.control.wake_at(now, Waker::from(Arc::new(Due(Weak::clone(this)))));
            }
            Mode::Replay => {}
        }
    }

    fn obey(&self, state: &mut State<A>) {
        let orders = std::mem::take(&mut *lock(&self.orders));
        for order in orders {
            let now = self.environment.clock().now();
            match order {
                Order::Options => {
                    let parameters = self.control.parameters();
                    let changed = {
                        let _entered = self.occupied.enter(self.environment.clock());
                        self.control.replacing_hooks(self.declaration.path, false, || {
                            state.slot.change(&self.context, &parameters)
                        })
                    };
                    match changed {
                        Ok(true) => {}
                        Ok(false) => self.remake(state, now),
                        Err(failed) => self.fail(state, &failed, now),
                    }
                }
                Order::Restart if state.slot.is_running() => self.remake(state, now),
                Order::Restart => {}
                Order::GiveUp => state.slot.give_up(),
            }
        }
    }

    /// Makes the actuator safe, then creates it again.
    fn remake(&self, state: &mut State<A>, now: MonotonicTime) {
        self.make_safe(state);
        self.make(state, now);
    }

    fn make(&self, state: &mut State<A>, now: MonotonicTime) {
        let parameters = self.control.parameters();
        let (path, slot) = (self.declaration.path, &mut state.slot);
        let made = {
            let _entered = self.occupied.enter(self.environment.clock());
            self.control.replacing_hooks(path, true, || slot.make(&self.context, &parameters))
        };
        match made {
            Ok(()) => {
                // A logger may block, and disarming needs the lock held here.
                let path = self.declaration.path;
                self.log(move || tracing::info!(component = path, "restarted"));
                state.is_unsafe = false;
            }
            Err(failed) => self.fail(state, &failed, now),
        }
    }

    fn log(&self, write: impl FnOnce() + Send + 'static) {
        match self.environment.mode() {
            Mode::Real => self.environment.pool().submit(Lane::Wakers, write),
            Mode::Virtual | Mode::Replay => write(),
        }
    }

    fn restart_if_due(&self, state: &mut State<A>, now: MonotonicTime) {
        if state.slot.restart_at().is_some_and(|at| at <= now) {
            self.make(state, now);
        }
    }

    /// Makes the actuator safe, even after a panic: hardware that may still move is worse than a second panic, which is caught.
    fn make_safe(&self, state: &mut State<A>) {
        let Some(actuator) = state.slot.running() else { return };
        if let Err(failed) = caught(|| actuator.disarm()) {
            state.is_unsafe = true;
            let message = format!("it has failed and could not be made safe: {}", failed.fault);
            self.tell_control(state, Told::Unsafe(message));
        }
    }

    fn tell_control(&self, state: &mut State<A>, told: Told) {
        match self.environment.mode() {
            Mode::Real => self.tell_now(told),
            Mode::Virtual | Mode::Replay => state.told.push(told),
        }
    }

    fn tell_now(&self, told: Told) {
        let ActuatorDeclaration { path, supervisor, .. } = *self.declaration;
        match told {
            Told::Failed { message, panicked } => {
                self.control.component_failed(path, supervisor, message, panicked)
            }
            Told::Unsafe(message) => self.control.note_hardware_error(path, message),
            Told::MessageFailed(message) => self.control.note_fault(path, message),
        }
    }

    fn fail(&self, state: &mut State<A>, failed: &Failed, now: MonotonicTime) {
        let message = failed.fault.to_string();
        self.tell_control(state, Told::Failed { message, panicked: failed.panicked });
        self.make_safe(state);
        if let AfterFault::RestartAt(at) = state.slot.fail(failed, now) {
            self.control.wake_at(at, Waker::from(Arc::new(Due(Weak::clone(&self.this)))));
        }
    }

    /// The disarm callback.
    fn disarm(&self) -> Result<(), Fault> {
        let disarmed = self.alone(|state| {
            if let Some(actuator) = state.slot.running() {
                return actuator.disarm();
            }
            if state.is_unsafe {
                return Err(Fault::new("it has failed, could not be made safe then, and cannot be reached"));
            }
            Ok(())
        });
        disarmed.unwrap_or_else(|| Err(Fault::new("its own code cannot wait for it to be disarmed")))
    }
}

/// Runs when the actuator's backoff is over or an update is due.
struct Due<A: Actuator>(Weak<Inner<A>>);

impl<A: Actuator> Wake for Due<A> {
    fn wake(self: Arc<Self>) {
        if let Some(inner) = self.0.upgrade() {
            inner.alone(|state| {
                inner.obey(state);
                let now = inner.environment.clock().now();
                inner.restart_if_due(state, now);
                inner.update_if_due(state, now);
            });
        }
    }
}

/// The common interface of all running actuators.
pub trait AnyActuator {
    /// Its path.
    fn path(&self) -> &'static str;
    /// The name of its command type.
    fn command_name(&self) -> &'static str;
    /// The topic on which its commands are published.
    fn any_topic(&self) -> &dyn AnyTopic;
    /// An `Arc<dyn Accepts<T>>`, where `T` is the type of its commands.
    #[doc(hidden)]
    fn accepts(&self) -> Box<dyn Any>;
    /// In a replay: publishes a command that it carried out; returns `false` if the command has another type.
    #[doc(hidden)]
    fn replay(&self, message: &DynamicMessage) -> bool;
    /// In a replay: creates the topic of its reports at `path`, if `path` is one of them.
    #[doc(hidden)]
    fn announce(&self, path: &str);
    /// Stops the actuator once it is free; returns `false` if it is still busy after `timeout`.
    #[doc(hidden)]
    fn terminate(&self, timeout: Duration) -> bool;
    /// The time at which its code was entered, if a thread is inside.
    #[doc(hidden)]
    fn entered_at(&self) -> Option<MonotonicTime>;
    /// The counts of the actuator.
    #[doc(hidden)]
    fn statistics(&self) -> ActuatorStatistics;
}

impl<A: Actuator> AnyActuator for ActuatorNode<A> {
    fn path(&self) -> &'static str {
        self.0.declaration.path
    }

    fn command_name(&self) -> &'static str {
        A::Command::NAME
    }

    fn any_topic(&self) -> &dyn AnyTopic {
        &self.0.topic
    }

    fn accepts(&self) -> Box<dyn Any> {
        let accepts: Arc<dyn Accepts<A::Command>> = Arc::clone(&self.0) as _;
        Box::new(accepts)
    }

    fn replay(&self, message: &DynamicMessage) -> bool {
        message.downcast::<A::Command>().map(|message| self.0.topic.publish(message)).is_some()
    }

    fn announce(&self, path: &str) {
        self.0.reports.announce_at(path, &self.0.context, &*self.0.host.0);
    }

    fn terminate(&self, timeout: Duration) -> bool {
        let Some(mut state) = enter_within(&self.0.state, timeout) else { return false };
        let fault = {
            let _entered = self.0.occupied.enter(self.0.environment.clock());
            state.slot.retire()
        };
        state.slot.stop();
        drop(state);
        if let Some(fault) = fault {
            self.0.control.note_fault(self.0.declaration.path, fault.to_string());
        }
        true
    }

    fn entered_at(&self) -> Option<MonotonicTime> {
        self.0.occupied.entered_at()
    }

    fn statistics(&self) -> ActuatorStatistics {
        self.0.counts.statistics(self.0.declaration.path)
    }
}

impl<A: Actuator> fmt::Debug for ActuatorNode<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActuatorNode").field("path", &self.0.declaration.path).finish_non_exhaustive()
    }
}

fn enter_within<S>(state: &Guarded<S>, timeout: Duration) -> Option<Held<'_, S>> {
    let start = Instant::now();
    loop {
        match state.try_enter() {
            Some(held) => return Some(held),
            None if start.elapsed() >= timeout => return None,
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
