//! The control state, and how it is entered.

use super::budgets::Budgets;
use super::command::{CommandStatistics, Prepared};
use super::effects::Reporter;
use super::execution::Slot;
use super::hooks::Hooks;
use super::machine::Machine;
use super::task::{Task, Value};
use super::topics::SystemTopics;
use crate::component::{DisarmHook, Host, Permit};
use crate::declaration::{
    CommandDeclaration, EstimatorDeclaration, ParameterDeclaration, ParameterValues, Supervisor,
};
use crate::event::{
    CategoryDeclaration, ComponentFault, DisarmError, HealthState, HealthTransition, Safety, SafetyError,
};
use crate::fault::Fault;
use crate::journal::Journal;
use crate::lifecycle::Supervision;
use crate::message::Origin;
use crate::node::{BindTarget, Check, Mode, NodeEntry, Report, SharedNode};
use crate::schedule::{Bell, Deadlines, Pool, Sleeper, Solo, StopSignal};
use crate::telemetry::Telemetry;
use crate::time::{Clock, MonotonicTime};
use crate::topology::Topology;
#[cfg(loom)]
use loom::sync::{Condvar, Mutex as StateMutex, MutexGuard, atomic::AtomicU8};
use std::collections::{HashMap, VecDeque};
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};
#[cfg(not(loom))]
use std::sync::{Condvar, Mutex as StateMutex, MutexGuard, atomic::AtomicU8};
use std::time::Duration;

/// What `robot!` declares of all this.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Declared {
    pub(crate) topology: &'static Topology,
    pub(crate) states: &'static [&'static str],
    pub(crate) categories: &'static [CategoryDeclaration],
    pub(crate) commands: &'static [CommandDeclaration],
    pub(crate) parameters: &'static [ParameterDeclaration],
    pub(crate) estimators: &'static [EstimatorDeclaration],
}

/// What [`Control::new`] takes.
pub(crate) struct Parts {
    pub(crate) declared: Declared,
    pub(crate) mode: Mode,
    pub(crate) topics: Arc<SystemTopics>,
    pub(crate) clock: Clock,
    pub(crate) origin: Origin,
    pub(crate) commands: Vec<Prepared>,
    pub(crate) parameters: ParameterValues,
    pub(crate) supervision: Supervision,
    pub(crate) nodes: Box<[SharedNode]>,
    pub(crate) journal: Option<Journal>,
    pub(crate) telemetry: Option<Telemetry>,
}

/// The robot as a whole. Clones are the same one.
#[derive(Clone)]
pub(crate) struct Control(pub(super) Arc<Inner>);

pub(super) struct Inner {
    pub(super) declared: Declared,
    pub(super) mode: Mode,
    pub(super) topics: Arc<SystemTopics>,
    pub(super) clock: Clock,
    pub(super) origin: Origin,
    pub(super) commands: Box<[Prepared]>,
    pub(super) nodes: Box<[SharedNode]>,
    pub(super) journal: Option<Journal>,
    pub(super) telemetry: Option<Telemetry>,
    pub(super) state: StateMutex<State>,
    /// Told of every entry: for those who wait for the robot to be disarmed, or for commands to be gone.
    pub(super) changed: Condvar,
    /// The safety state, for actuators, which ask before every command.
    pub(super) safety: AtomicU8,
    pub(super) bell: Bell,
    pub(super) sleeper: Sleeper,
    /// When estimators are lost unless a run has been completed.
    pub(super) watch: Deadlines<usize>,
    pub(super) limits: Deadlines<Limit>,
    pub(super) pool: Pool,
    /// Disarm callbacks outside of a disarming, by component and number.
    pub(super) callbacks: Solo<(&'static str, usize)>,
    pub(super) reporter: Reporter,
    /// How many commands have begun at the last instant of virtual time at which one did.
    pub(super) begun: Mutex<(MonotonicTime, u32)>,
    /// Commands to be polled, on virtual time.
    pub(super) ready: Mutex<VecDeque<Arc<Task>>>,
    /// Disarm callbacks to be run by the loop of a simulation.
    pub(super) pending_hooks: Mutex<VecDeque<(u64, Vec<NumberedHook>)>>,
    /// What islands reported in a replay, until the journal says that it was taken note of.
    pub(super) reports: Mutex<HashMap<usize, VecDeque<Report>>>,
    pub(super) faults: Mutex<Faults>,
    /// A sensor or a service was told something, on virtual time.
    pub(super) has_orders: AtomicBool,
    /// Tells sensors and services to stop.
    pub(super) stop: StopSignal,
    pub(super) islands: OnceLock<Box<dyn Islands>>,
    /// Weak, since the host has the control state.
    pub(super) host: OnceLock<Weak<dyn Host>>,
}

/// What the control state adds to a report.
pub(crate) struct Summary {
    pub(crate) commands: Vec<CommandStatistics>,
    pub(crate) state: &'static str,
    pub(crate) safety: Safety,
    /// The newest.
    pub(crate) faults: Vec<ComponentFault>,
    pub(crate) all_faults: u64,
}

/// Where entries for estimators go.
pub(crate) trait Islands: Send + Sync {
    /// Adds an entry. What is returned is dropped without the lock: it may be the last owner of the wiring.
    fn post(&self, estimator: usize, now: MonotonicTime, entry: NodeEntry) -> Option<Wired>;
}

/// Keeps a robot's wiring alive.
pub(crate) type Wired = Arc<dyn std::any::Any + Send + Sync>;

/// A time limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Limit {
    /// The `timeout` of an execution.
    Execution(u64),
    /// How long an arming command waits for cancelled ones.
    Arming,
    /// How long disarm callbacks may take.
    Disarming(u64),
}

/// The control state's lock.
pub(super) type StateGuard<'a> = MutexGuard<'a, State>;

pub(super) struct State {
    pub(super) machine: Machine,
    pub(super) executions: Vec<RunningCommand>,
    pub(super) statistics: Vec<CommandStatistics>,
    pub(super) next_id: u64,
    pub(super) parameters: ParameterValues,
    /// How often parameters were set.
    pub(super) version: u64,
    pub(super) bound: Vec<Bound>,
    pub(super) hooks: Hooks,
    pub(super) budgets: Budgets,
    pub(super) health: Vec<Health>,
    pub(super) components: Vec<Supervised>,
    pub(super) disarming: Option<Disarming>,
    /// What became of the last disarming.
    pub(super) last_disarm: Result<(), DisarmError>,
    /// How often somebody asked for the robot to be disarmed: who waits to arm it since before does not.
    pub(super) disarms: u64,
    /// How often the robot was disarmed.
    pub(super) generation: u64,
    pub(super) is_stopping: bool,
    /// The journal and the last report are made: entries that come later are neither written nor published.
    pub(super) has_ended: bool,
}

/// An execution of a command.
pub(super) struct RunningCommand {
    pub(super) id: u64,
    /// The number of the command.
    pub(super) command: usize,
    pub(super) health: Option<HealthTransition>,
    pub(super) slot: Arc<Slot>,
    pub(super) permit: Permit,
    /// None in a replay.
    pub(super) task: Option<Arc<Task>>,
    pub(super) phase: Phase,
}

/// How far an execution is.
pub(super) enum Phase {
    Running,
    /// Its code has succeeded; the robot is being disarmed by it.
    Disarming(Option<Value>, Option<&'static str>),
    /// Its code has succeeded; it arms the robot once cancelled commands are gone.
    Arming(Option<Value>, Option<&'static str>),
    /// It was cancelled or has timed out, and its code has not returned yet.
    Lingering,
}

/// The health of an estimator as it was published, and how often it was lost.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Health {
    pub(super) state: HealthState,
    pub(super) epoch: u32,
}

/// A component whose options are bound to parameters.
pub(super) struct Bound {
    pub(super) path: &'static str,
    pub(super) parameters: &'static [usize],
    pub(super) check: Arc<Check>,
    pub(super) target: BindTarget,
}

/// A sensor, a service or an actuator that a supervisor looks after.
pub(super) struct Supervised {
    pub(super) path: &'static str,
    pub(super) supervisor: Supervisor,
    pub(super) order: Box<dyn Fn(ComponentOrder) + Send + Sync>,
}

/// What a supervisor tells a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ComponentOrder {
    /// Restart.
    Restart,
    /// Stay stopped.
    GiveUp,
}

/// The robot is being disarmed.
pub(super) struct Disarming {
    pub(super) generation: u64,
    pub(super) force: bool,
    /// It ends in `error`, whatever the callbacks say.
    pub(super) to_error: bool,
    /// The execution that disarms it.
    pub(super) by: Option<u64>,
    /// How many callbacks were begun.
    pub(super) begun: usize,
    /// Those that have not returned.
    pub(super) left: Vec<(usize, &'static str)>,
    /// Where those who wait for it find what became of it.
    pub(super) outcome: Arc<OnceLock<Result<(), DisarmError>>>,
    pub(super) errors: Vec<SafetyError>,
}

/// A disarm callback, its number among those that run, and the path of its component.
pub(super) type NumberedHook = (usize, &'static str, DisarmHook);

/// The newest faults, and how many there were.
#[derive(Default)]
pub(super) struct Faults {
    pub(super) newest: VecDeque<ComponentFault>,
    pub(super) count: u64,
}

/// Faults that are kept; of earlier ones only the number is.
pub(super) const KEPT_FAULTS: usize = 256;

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
            version: 0,
            bound: Vec::new(),
            hooks: Hooks::default(),
            budgets: Budgets::new(declared.topology, supervision),
            health: vec![Health::default(); declared.estimators.len()],
            components: Vec::new(),
            disarming: None,
            last_disarm: Ok(()),
            disarms: 0,
            generation: 0,
            is_stopping: false,
            has_ended: false,
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
            callbacks: Solo::default(),
            bell,
            reporter: Reporter::default(),
            begun: Mutex::new((MonotonicTime::MAX, 0)),
            ready: Mutex::default(),
            pending_hooks: Mutex::default(),
            reports: Mutex::default(),
            faults: Mutex::default(),
            has_orders: AtomicBool::new(false),
            stop: StopSignal::default(),
            islands: OnceLock::new(),
            host: OnceLock::new(),
        }));
        control.bind_commands();
        control
    }

    /// Says where islands are, once the robot is wired.
    pub(crate) fn set_islands(&self, islands: Box<dyn Islands>) {
        // It is set once.
        let _ = self.0.islands.set(islands);
    }

    /// Says what components and commands see of the robot.
    pub(crate) fn set_host(&self, host: &Arc<dyn Host>) {
        // It is set once.
        let _ = self.0.host.set(Arc::downgrade(host));
    }

    /// What it differs from other robots by.
    pub(super) fn id(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }

    pub(crate) fn downgrade(&self) -> WeakControl {
        WeakControl(Arc::downgrade(&self.0))
    }

    /// The state, for a look; entries are processed by [`Self::step`](super::step).
    pub(super) fn lock(&self) -> StateGuard<'_> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until `holds`, `longest` at most; whether it does.
    #[cfg(not(loom))]
    pub(super) fn wait_until(&self, longest: Duration, holds: impl Fn(&State) -> bool) -> bool {
        let deadline = std::time::Instant::now() + longest;
        let mut state = self.lock();
        while !holds(&state) {
            let left = deadline.saturating_duration_since(std::time::Instant::now());
            if left.is_zero() {
                return false;
            }
            state = self.0.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }

    /// A model has no time: others go on once.
    #[cfg(loom)]
    pub(super) fn wait_until(&self, _: Duration, holds: impl Fn(&State) -> bool) -> bool {
        loom::thread::yield_now();
        holds(&self.lock())
    }

    /// Has a supervisor look after a sensor, a service or an actuator.
    pub(crate) fn look_after(
        &self,
        path: &'static str,
        supervisor: Supervisor,
        order: impl Fn(ComponentOrder) + Send + Sync + 'static,
    ) {
        self.lock().components.push(Supervised { path, supervisor, order: Box::new(order) });
    }

    /// A sensor or a service was told something: on virtual time it obeys before time goes on.
    pub(crate) fn note_order(&self) {
        self.0.has_orders.store(true, Ordering::Release);
    }

    /// Whether any was told something since the last time.
    pub(crate) fn take_orders(&self) -> bool {
        self.0.has_orders.swap(false, Ordering::AcqRel)
    }

    pub(crate) fn state(&self) -> &'static str {
        self.lock().machine.state()
    }

    pub(crate) fn safety(&self) -> Safety {
        self.lock().machine.safety
    }

    /// The same without the lock: for actuators, which ask under a lock of their own before every command.
    pub(crate) fn safety_now(&self) -> Safety {
        match self.0.safety.load(Ordering::SeqCst) {
            safety if safety == Safety::Armed as u8 => Safety::Armed,
            safety if safety == Safety::Disarming as u8 => Safety::Disarming,
            safety if safety == Safety::Error as u8 => Safety::Error,
            _ => Safety::Disarmed,
        }
    }

    /// Calls `call` with what has been done so far, while no entry is processed.
    pub(crate) fn between_entries<T>(&self, call: impl FnOnce(Summary) -> T) -> T {
        let state = self.lock();
        call(self.summary(&state))
    }

    /// The same after the last entry.
    pub(crate) fn end<T>(&self, call: impl FnOnce(Summary) -> T) -> T {
        let mut state = self.lock();
        state.has_ended = true;
        call(self.summary(&state))
    }

    fn summary(&self, state: &State) -> Summary {
        let (faults, all_faults) = {
            let faults = self.0.faults.lock().unwrap_or_else(PoisonError::into_inner);
            (faults.newest.iter().cloned().collect(), faults.count)
        };
        Summary {
            commands: state.statistics.clone(),
            state: state.machine.state(),
            safety: state.machine.safety,
            faults,
            all_faults,
        }
    }

    pub(crate) fn clock(&self) -> &Clock {
        &self.0.clock
    }

    pub(crate) fn origin(&self) -> Origin {
        self.0.origin
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

/// Does not keep the robot alive.
#[derive(Clone)]
pub(crate) struct WeakControl(Weak<Inner>);

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
