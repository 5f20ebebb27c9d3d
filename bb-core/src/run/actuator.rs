//! A running actuator: when it may move, and how its failures are handled.

mod any;
mod commands;
mod held;
mod limits;
mod reports;
mod telling;
mod updating;

pub use self::any::AnyActuator;
use self::held::{Guarded, Held};
pub use self::limits::ActuatorStatistics;
use self::limits::Counts;
use self::reports::publish_reports;
use self::telling::Change;
use self::updating::Due;
use super::occupied::Occupied;
use super::source::{Assembly, Order};
use crate::component::{Accepts, Actuator, ActuatorContext, ActuatorError, Binding, Caller, OptionsList};
use crate::control::{ComponentOrder, Control};
use crate::declaration::ActuatorDeclaration;
use crate::fault::{Failed, Fault, Termination, caught, lock};
use crate::lifecycle::{AfterFault, AsActuator, Recipe, Slot};
use crate::node::{BindTarget, Environment, Mode};
use crate::payload::MotionEnd;
use crate::pubsub::{AnyTopic, Topic, Wakers};
use crate::schedule::Lane;
use crate::time::MonotonicTime;
use std::fmt;
use std::sync::{Arc, Mutex, Weak};
use std::task::Waker;

/// An actuator in the wiring.
pub struct ActuatorNode<A: Actuator>(Arc<Inner<A>>);

struct Inner<A: Actuator> {
    this: Weak<Self>,
    number: usize,
    declaration: &'static ActuatorDeclaration,
    context: ActuatorContext,
    environment: Environment,
    control: Control,
    /// Topic of its commands.
    topic: Arc<Topic<A::Command>>,
    /// Orders from its supervisor and parameter changes.
    orders: Mutex<Vec<Order>>,
    /// Time at which its code was entered.
    occupied: Occupied,
    counts: Counts,
    /// Held while its code runs. Anything that must not wait for user code must not take this lock.
    state: Guarded<State<A>>,
}

struct State<A: Actuator> {
    slot: Slot<AsActuator<A>>,
    /// `true` if the actuator has failed and could not be made safe.
    is_unsafe: bool,
    /// `true` if the actuator was asked to carry out a command after it was last made safe.
    may_move: bool,
    /// The command execution that sent the last command to be carried out.
    moved_by: Caller,
    /// Time of the next update for which a wake-up is set.
    alarm: Option<MonotonicTime>,
    /// Changes to report to the control state once the lock is released, on virtual time. Loggers, telemetry handlers and subscribers
    /// receive them on this thread and may disarm the robot, which takes the lock.
    pending: Vec<Change>,
}

impl<A: Actuator> ActuatorNode<A> {
    /// Creates the actuator; an error that prevents the robot from starting is stored in `assembly`.
    pub fn new(
        number: usize,
        declaration: &'static ActuatorDeclaration,
        options: &OptionsList,
        component: usize,
        binding: Binding<A::Options>,
        assembly: &Assembly,
    ) -> Self {
        let options = options.of::<A::Options>(component);
        let host = Arc::clone(&assembly.host);
        let side = host.replacement(declaration.path).map_or(A::SIDE, |replacement| replacement.side());
        let context = ActuatorContext::new(declaration, host, side);
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
        let robot = control.id();
        let topic = control.topics().of_commands(number);
        let topic = topic.unwrap_or_else(|| Arc::new(Topic::new(declaration.path)));
        let inner = Arc::new_cyclic(|this| Inner {
            this: Weak::clone(this),
            number,
            declaration,
            context,
            environment,
            control,
            topic,
            orders: Mutex::default(),
            occupied: Occupied::new(),
            counts: Counts::default(),
            state: Guarded::new(
                robot,
                State {
                    slot,
                    is_unsafe: false,
                    may_move: false,
                    moved_by: Caller::PROGRAM,
                    alarm: None,
                    pending: Vec::new(),
                },
            ),
        });
        // The actuator may have work to do from the start.
        if inner.environment.mode() != Mode::Replay {
            inner.alone(|_| ());
        }
        let weak = Arc::downgrade(&inner);
        let target = BindTarget::Other(Box::new(move || Inner::tell(&weak, Order::Options)));
        inner.environment.bind(declaration.path, options, binding, target);
        inner.register();
        Self(inner)
    }

    /// Creates the topic of its commands at `path`, before the actuator exists.
    pub fn new_topic(path: &'static str) -> Arc<dyn AnyTopic> {
        Arc::new(Topic::<A::Command>::new(path))
    }

    /// Carries out a command from an outside caller.
    ///
    /// # Errors
    /// See [`ActuatorError`].
    pub fn send(&self, command: A::Command) -> Result<(), ActuatorError> {
        self.0.accept(command, &Caller::PROGRAM).map(drop)
    }
}

impl<A: Actuator> Inner<A> {
    /// Registers the callbacks of the control state. They hold weak references, since the actuator owns that state, which stores them.
    fn register(&self) {
        let ActuatorDeclaration { path, supervisor, .. } = *self.declaration;
        let weak = Weak::clone(&self.this);
        self.control.supervise(path, supervisor, move |order| Inner::tell(&weak, Order::Supervisor(order)));
        let weak = Weak::clone(&self.this);
        let disarm = move || weak.upgrade().map_or(Ok(()), |inner| inner.disarm());
        self.control.on_disarm_always(path, Arc::new(disarm));
    }

    /// Calls `run` while no other code of the actuator runs. Returns `None` if that would deadlock: the caller is code of this actuator,
    /// or of another one that this actuator waits for.
    fn alone<T>(&self, run: impl FnOnce(&mut State<A>) -> T) -> Option<T> {
        let mut state = self.state.enter()?;
        let result = run(&mut state);
        self.leave(state);
        Some(result)
    }

    /// Leaves the actuator's code: schedules its next update, publishes its reports, and reports pending changes.
    fn leave(&self, mut state: Held<'_, State<A>>) {
        self.schedule_update(&mut state);
        let mut wakers = Wakers::default();
        if let Some(topics) = self.control.topics().actuators.get(self.number) {
            publish_reports(topics, &self.context, &self.environment, &mut wakers);
        }
        let pending = std::mem::take(&mut state.pending);
        drop(state);
        self.control.count_waker_panics(wakers.run());
        pending.into_iter().for_each(|change| self.tell_now(change));
    }

    /// Queues an order. It does not wait for the actuator's code, as the caller is the control state.
    fn tell(this: &Weak<Self>, order: Order) {
        let Some(inner) = this.upgrade() else { return };
        let mut orders = lock(&inner.orders);
        if orders.contains(&order) {
            // The order is already waiting.
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

    /// Carries out the queued orders.
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
                        Ok(false) => self.remake(state, Termination::NewOptions, now),
                        Err(failed) => self.fail(state, &failed, now),
                    }
                }
                Order::Supervisor(ComponentOrder::Restart) if state.slot.is_running() => {
                    self.remake(state, Termination::Supervisor, now);
                }
                Order::Supervisor(ComponentOrder::Restart) => {}
                Order::Supervisor(ComponentOrder::GiveUp) => state.slot.give_up(),
            }
        }
    }

    /// Makes the actuator safe, then creates it again.
    fn remake(&self, state: &mut State<A>, why: Termination<'_>, now: MonotonicTime) {
        let reason = "the actuator is restarted";
        self.context.set_failing(reason);
        self.make_safe(state);
        self.end_motion(MotionEnd::Failed(reason.to_owned()));
        {
            let _entered = self.occupied.enter(self.environment.clock());
            state.slot.restart(now, why);
        }
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
                self.log(state, move || tracing::info!(component = path, "restarted"));
                state.is_unsafe = false;
                self.counts.note_stopped(None);
            }
            Err(failed) => self.fail(state, &failed, now),
        }
    }

    fn restart_if_due(&self, state: &mut State<A>, now: MonotonicTime) {
        if state.slot.restart_at().is_some_and(|at| at <= now) {
            self.make(state, now);
        }
    }

    /// Disarms the actuator, even after a panic: hardware that may still move is worse than a second panic, which is caught.
    pub(super) fn make_safe(&self, state: &mut State<A>) {
        let Some(actuator) = state.slot.running() else { return };
        state.may_move = false;
        if let Err(failed) = caught(|| actuator.disarm()) {
            state.is_unsafe = true;
            let message = format!("it has failed and could not be made safe: {}", failed.fault);
            self.tell_control(state, Change::Unsafe(message));
        }
    }

    fn fail(&self, state: &mut State<A>, failed: &Failed, now: MonotonicTime) {
        let message = failed.fault.to_string();
        self.context.set_failing(&message);
        self.counts.note_stopped(Some(message.clone()));
        self.tell_control(state, Change::Failed { message: message.clone(), panicked: failed.panicked });
        self.make_safe(state);
        let restart = state.slot.fail(failed, now);
        self.end_motion(MotionEnd::Failed(message));
        if let AfterFault::RestartAt(at) = restart {
            self.control.wake_at(at, Waker::from(Arc::new(Due(Weak::clone(&self.this)))));
        }
    }

    /// Reports the end of a motion that the actuator's code has left without an end.
    fn end_motion(&self, end: MotionEnd) {
        let newest = self.environment.joints().status(self.declaration.joint);
        let newest = newest.and_then(|status| status.position.first().copied());
        self.context.end_current_motion(end, |begin| newest.unwrap_or(begin.initial_position));
    }

    /// The disarm callback.
    fn disarm(&self) -> Result<(), Fault> {
        let disarmed = self.alone(|state| {
            if let Some(actuator) = state.slot.running() {
                let disarmed = caught(|| actuator.disarm()).map_err(|failed| failed.fault);
                state.may_move = false;
                match &disarmed {
                    Err(fault) => self.end_motion(MotionEnd::Failed(fault.to_string())),
                    // Without a next update, the actuator does not report the end itself.
                    Ok(()) if self.next_update(state).is_none() => self.end_motion(MotionEnd::Stopped),
                    Ok(()) => {}
                }
                return disarmed;
            }
            if state.is_unsafe {
                return Err(Fault::new("it has failed, could not be made safe then, and cannot be reached"));
            }
            Ok(())
        });
        disarmed.unwrap_or_else(|| Err(Fault::new("its own code cannot wait for it to be disarmed")))
    }
}

impl<A: Actuator> fmt::Debug for ActuatorNode<A> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActuatorNode").field("path", &self.0.declaration.path).finish_non_exhaustive()
    }
}
