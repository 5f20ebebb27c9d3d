//! Creating and inspecting the control state, and its topics.

use super::callbacks::Hooks;
use super::command::CommandStatistics;
use super::effects::Reporter;
use super::faults::Budgets;
use super::step::Machine;
use super::{
    ComponentOrder, Control, Health, Inner, Islands, Parts, State, StateGuard, StateMutex, Summary, Supervised,
    WeakControl,
};
use crate::component::{Controls, Host, RunKind};
use crate::declaration::{ActuatorDeclaration, CommandDeclaration, RobotDeclaration, Supervisor};
use crate::event::{
    CommandEvent, ComponentFault, HealthTransition, ParameterChange, Safety, SafetyError, SafetyTransition,
    StateTransition,
};
use crate::fault::{Fault, lock, wake};
use crate::journal::JournalLine;
use crate::message::{Origin, Payload};
use crate::node::Mode;
use crate::payload::{BeginMotion, EndMotion};
use crate::pubsub::{AnyTopic, Registry, Topic};
use crate::schedule::{Bell, Deadlines, Pool, Reserve, Sleeper, StopSignal};
use crate::time::Clock;
#[cfg(loom)]
use loom::sync::{Condvar, atomic::AtomicU8};
use std::any::Any;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};
#[cfg(not(loom))]
use std::sync::{Condvar, atomic::AtomicU8};
use std::task::Waker;
use std::time::Duration;

impl Control {
    pub(crate) fn new(parts: Parts) -> Self {
        let Parts { declared, mode, topics, clock, origin, commands, parameters, supervision, .. } = parts;
        let statistics =
            |command: &CommandDeclaration| CommandStatistics { name: command.name, ..Default::default() };
        let state = State {
            machine: Machine::default(),
            executions: Vec::new(),
            statistics: declared.commands.iter().map(statistics).collect(),
            next_id: 1,
            parameters,
            bound: Vec::new(),
            hooks: Hooks::default(),
            budgets: Budgets::new(declared.topology, supervision),
            health: vec![Health::default(); declared.estimators.len()],
            components: Vec::new(),
            disarming: None,
            apart: Vec::new(),
            next_apart: 0,
            held: Vec::new(),
            held_lingering: Vec::new(),
            last_disarm: Ok(()),
            disarms: 0,
            generation: 0,
            has_begun: false,
            sources: 0,
            is_stopping: false,
            has_ended: false,
            parameters_are_final: false,
        };
        let bell = Bell::default();
        let alarm = bell.clone();
        let control = Self(Arc::new(Inner {
            declared,
            mode,
            topics,
            clock,
            origin,
            commands: commands.into(),
            nodes: parts.nodes,
            journal: parts.journal,
            telemetry: parts.telemetry,
            state: StateMutex::new(state),
            changed: Condvar::new(),
            safety: AtomicU8::new(Safety::Disarmed as u8),
            sleeper: Sleeper::new(bell.clone()),
            watch: Deadlines::new(bell.clone()),
            limits: Deadlines::new(bell.clone()),
            pool: Pool::new(move || alarm.ring()),
            reserve: Reserve::default(),
            spare: Reserve::default(),
            bell,
            reporter: Reporter::default(),
            logger_panics: AtomicU64::new(0),
            waker_panics: AtomicU64::new(0),
            ready: Mutex::default(),
            pending_hooks: Mutex::default(),
            reports: Mutex::default(),
            faults: Mutex::default(),
            safety_errors: Mutex::default(),
            has_orders: AtomicBool::new(false),
            stop: StopSignal::default(),
            islands: OnceLock::new(),
            host: OnceLock::new(),
            on_parameters: OnceLock::new(),
        }));
        control.bind_commands();
        control
    }

    /// Sets the islands, once the robot is wired.
    pub(crate) fn set_islands(&self, islands: Box<dyn Islands>) {
        // It is set once.
        let _ = self.0.islands.set(islands);
    }

    /// Sets the interface that components and commands have to the robot.
    pub(crate) fn set_host(&self, host: &Arc<dyn Host>) {
        // It is set once.
        let _ = self.0.host.set(Arc::downgrade(host));
    }

    /// Distinguishes it from other robots.
    pub(crate) fn id(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    pub(crate) fn downgrade(&self) -> WeakControl {
        WeakControl(Arc::downgrade(&self.0))
    }

    /// Locks the state for reading; entries are processed by [`Self::step`](super::step).
    pub(super) fn lock(&self) -> StateGuard<'_> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `holds`, `longest` at most. Returns whether it holds.
    pub(super) fn wait_until(&self, longest: Duration, holds: impl Fn(&State) -> bool) -> bool {
        self.locked_once(longest, &holds).1
    }

    #[cfg(not(loom))]
    pub(super) fn locked_once(&self, longest: Duration, holds: &dyn Fn(&State) -> bool) -> (StateGuard<'_>, bool) {
        let deadline = std::time::Instant::now() + longest;
        let mut state = self.lock();
        loop {
            let left = deadline.saturating_duration_since(std::time::Instant::now());
            match holds(&state) {
                false if !left.is_zero() => {}
                is_so => return (state, is_so),
            }
            state = self.0.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// A model has no time: other threads get one turn.
    #[cfg(loom)]
    pub(super) fn locked_once(&self, _: Duration, holds: &dyn Fn(&State) -> bool) -> (StateGuard<'_>, bool) {
        loom::thread::yield_now();
        let state = self.lock();
        let holds = holds(&state);
        (state, holds)
    }

    /// Adds a sensor, a service or an actuator to its supervisor.
    pub(crate) fn supervise(
        &self,
        path: &'static str,
        supervisor: Supervisor,
        order: impl Fn(ComponentOrder) + Send + Sync + 'static,
    ) {
        self.lock().components.push(Supervised { path, supervisor, order: Box::new(order) });
    }

    /// A sensor or a service got an order: on virtual time, it obeys before time advances.
    pub(crate) fn note_order(&self) {
        self.0.has_orders.store(true, Ordering::Release);
    }

    /// Returns whether any component got an order since the last call.
    pub(crate) fn take_orders(&self) -> bool {
        self.0.has_orders.swap(false, Ordering::AcqRel)
    }

    /// The safety state, without the lock: for actuators, which ask under their own lock before every command.
    pub(crate) fn safety_now(&self) -> Safety {
        match self.0.safety.load(Ordering::SeqCst) {
            safety if safety == Safety::Armed as u8 => Safety::Armed,
            safety if safety == Safety::Disarming as u8 => Safety::Disarming,
            safety if safety == Safety::Error as u8 => Safety::Error,
            _ => Safety::Disarmed,
        }
    }

    /// Calls `call` with a summary so far, while no entry is processed.
    pub(crate) fn between_entries<T>(&self, call: impl FnOnce(Summary) -> T) -> T {
        let state = self.lock();
        call(self.summary(&state))
    }

    /// Calls `call` with a summary after the last entry.
    pub(crate) fn end<T>(&self, call: impl FnOnce(Summary) -> T) -> T {
        let mut state = self.lock();
        state.has_ended = true;
        call(self.summary(&state))
    }

    fn summary(&self, state: &State) -> Summary {
        let (faults, all_faults) = {
            let faults = lock(&self.0.faults);
            (faults.newest(), faults.count())
        };
        Summary {
            commands: state.statistics.clone(),
            state: state.machine.state(),
            safety: state.machine.safety,
            faults,
            all_faults,
            safety_errors: lock(&self.0.safety_errors).all(),
            logger_panics: self.0.logger_panics.load(Ordering::Relaxed),
            waker_panics: self.0.waker_panics.load(Ordering::Relaxed),
        }
    }

    /// Counts wakers that panicked.
    pub(crate) fn count_waker_panics(&self, panics: u64) {
        self.0.waker_panics.fetch_add(panics, Ordering::Relaxed);
    }

    /// Wakes a task, and counts a panic of its waker.
    pub(crate) fn wake(&self, waker: Waker) {
        self.count_waker_panics(u64::from(!wake(waker)));
    }

    pub(crate) fn clock(&self) -> &Clock {
        &self.0.clock
    }

    pub(crate) fn topics(&self) -> &SystemTopics {
        &self.0.topics
    }

    pub(crate) fn bell(&self) -> &Bell {
        &self.0.bell
    }

    pub(crate) fn pool(&self) -> &Pool {
        &self.0.pool
    }

    pub(crate) fn stop_signal(&self) -> &StopSignal {
        &self.0.stop
    }

    pub(crate) fn is_virtual(&self) -> bool {
        self.0.mode != Mode::Real
    }

    pub(super) fn host(&self) -> Result<Arc<dyn Host>, Fault> {
        self.0.host.get().and_then(Weak::upgrade).ok_or_else(|| Fault::new("the robot is gone"))
    }
}

impl Controls for Control {
    fn origin(&self) -> Origin {
        self.0.origin
    }

    fn clock(&self) -> &Clock {
        &self.0.clock
    }

    fn is_stopping(&self) -> bool {
        self.0.stop.is_set()
    }

    fn state(&self) -> &'static str {
        self.lock().machine.state()
    }

    fn safety(&self) -> Safety {
        self.lock().machine.safety
    }

    fn kind_of_run(&self) -> RunKind {
        match self.0.mode {
            Mode::Real => RunKind::Live,
            Mode::Virtual => RunKind::Simulation,
            Mode::Replay => RunKind::Replay,
        }
    }
}

impl WeakControl {
    pub(crate) fn upgrade(&self) -> Option<Control> {
        self.0.upgrade().map(Control)
    }
}

impl fmt::Debug for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Control").field("robot", &self.0.origin.robot).finish_non_exhaustive()
    }
}

/// The topics that every robot has, and those of its commands, parameters and actuators.
#[derive(Debug)]
pub struct SystemTopics {
    pub(crate) state: Topic<StateTransition>,
    pub(crate) safety: Topic<SafetyTransition>,
    pub(crate) safety_error: Topic<SafetyError>,
    pub(crate) health: Topic<HealthTransition>,
    pub(crate) fault: Topic<ComponentFault>,
    pub(crate) journal: Topic<JournalLine>,
    pub(crate) commands: Box<[Topic<CommandEvent>]>,
    pub(crate) parameters: Box<[Topic<ParameterChange>]>,
    pub(crate) actuators: Box<[ActuatorTopics]>,
    /// Topics created at run time.
    pub(crate) registry: Registry,
}

/// The topics of one actuator.
pub(crate) struct ActuatorTopics {
    commands: Arc<dyn AnyTopic>,
    pub(crate) begin_motion: Topic<BeginMotion>,
    pub(crate) end_motion: Topic<EndMotion>,
}

impl ActuatorTopics {
    fn new(declared: &ActuatorDeclaration) -> Self {
        let [begin_motion, end_motion] = declared.motions;
        Self {
            commands: (declared.new_topic)(declared.path),
            begin_motion: Topic::new(begin_motion),
            end_motion: Topic::new(end_motion),
        }
    }
}

impl fmt::Debug for ActuatorTopics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("ActuatorTopics").field(&self.commands.path()).finish()
    }
}

impl SystemTopics {
    pub(crate) fn new(declared: &RobotDeclaration) -> Self {
        Self {
            state: Topic::new("state_machine"),
            safety: Topic::new("safety"),
            safety_error: Topic::new("safety/error"),
            health: Topic::new("health"),
            fault: Topic::new("fault"),
            journal: Topic::new("journal"),
            commands: declared.commands.iter().map(|command| Topic::new(command.path)).collect(),
            parameters: declared.parameters.iter().map(|parameter| Topic::new(parameter.path)).collect(),
            actuators: declared.actuators.iter().map(ActuatorTopics::new).collect(),
            registry: Registry::default(),
        }
    }

    pub(crate) fn all(&self) -> Vec<&dyn AnyTopic> {
        let mut all: Vec<&dyn AnyTopic> = Vec::new();
        for ActuatorTopics { commands, begin_motion, end_motion } in &self.actuators {
            all.extend([&**commands as &dyn AnyTopic, begin_motion, end_motion]);
        }
        let fixed: [&dyn AnyTopic; 6] =
            [&self.state, &self.safety, &self.safety_error, &self.health, &self.fault, &self.journal];
        all.extend(fixed);
        for topic in &self.commands {
            all.push(topic);
        }
        for topic in &self.parameters {
            all.push(topic);
        }
        all
    }

    /// The topic of the commands of the actuator with that number, if they are of type `T`.
    pub(crate) fn of_commands<T: Payload>(&self, number: usize) -> Option<Arc<Topic<T>>> {
        let topic: Arc<dyn Any + Send + Sync> = Arc::clone(&self.actuators.get(number)?.commands) as _;
        topic.downcast().ok()
    }
}
