//! The robot as a whole: commands, operational state, safety, parameters, supervision and health, and the topics on
//! which they are published.
//!
//! This state has a single writer at a time, like an island: a thread with an entry takes the lock for some
//! microseconds, writes the entry's line to the journal, changes the state and publishes the changes. No user code
//! runs meanwhile. Effects that are user code (disarm callbacks, futures of commands, wakers, handlers, loggers) are
//! collected as `Effects` and run without the lock, on their own threads or on those of the pool. Each may block
//! forever without harming anything else.

mod arming;
#[cfg(test)]
mod bare;
mod callbacks;
mod command;
mod commands;
mod effects;
mod ending;
mod execution;
mod faults;
mod health;
#[cfg(all(test, loom))]
mod model;
mod parameters;
mod registering;
mod step;
mod system;

pub use command::{CommandStatistics, Prepared};
pub(crate) use commands::Hanging;
pub use execution::{CommandError, Execution};
pub use faults::{ReportedFault, ReportedSafetyError};
pub(crate) use system::{ActuatorTopics, SystemTopics};

use crate::component::{Caller, Host};
use crate::declaration::{ParameterValues, RobotDeclaration, Supervisor};
use crate::event::{DisarmError, HealthState, HealthTransition, Safety, SafetyError};
use crate::journal::{Journal, ParameterEntry};
use crate::lifecycle::Supervision;
use crate::message::Origin;
use crate::node::{BindTarget, Check, Mode, NodeEntry, Report, SharedNode};
use crate::pubsub::DynamicMessage;
use crate::schedule::{Bell, Deadlines, Pool, Reserve, Sleeper, StopSignal};
use crate::telemetry::Telemetry;
use crate::time::{Clock, MonotonicTime};
use bb_message::__private::Sorted;
use callbacks::{Apart, Callback, Hooks};
use effects::Reporter;
use execution::{EndedCode, Slot, Task, Value};
use faults::{Budgets, Faults, SafetyErrors};
#[cfg(loom)]
use loom::sync::{Condvar, Mutex as StateMutex, MutexGuard, atomic::AtomicU8};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, OnceLock, Weak};
#[cfg(not(loom))]
use std::sync::{Condvar, Mutex as StateMutex, MutexGuard, atomic::AtomicU8};
use step::Machine;

/// The arguments of [`Control::new`].
pub(crate) struct Parts {
    pub(crate) declared: &'static RobotDeclaration,
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

/// The robot as a whole. Clones share it.
#[derive(Clone)]
pub(crate) struct Control(Arc<Inner>);

struct Inner {
    declared: &'static RobotDeclaration,
    mode: Mode,
    topics: Arc<SystemTopics>,
    clock: Clock,
    origin: Origin,
    commands: Box<[Prepared]>,
    nodes: Box<[SharedNode]>,
    journal: Option<Journal>,
    telemetry: Option<Telemetry>,
    state: StateMutex<State>,
    /// Notified of every entry, for threads that wait for the robot to be disarmed or for commands to be gone.
    changed: Condvar,
    /// The safety state, for actuators, which check it before every command.
    safety: AtomicU8,
    bell: Bell,
    sleeper: Sleeper,
    /// Time at which each estimator is lost unless a run has been completed.
    watch: Deadlines<usize>,
    limits: Deadlines<Limit>,
    pool: Pool,
    /// The threads of disarm callbacks of components, each of which has one.
    reserve: Reserve,
    /// Threads of other disarm callbacks, such as the ones of commands, which may be any number.
    spare: Reserve,
    reporter: Reporter,
    /// Numbers of panics of loggers, and of wakers that the control state has woken.
    logger_panics: AtomicU64,
    waker_panics: AtomicU64,
    /// Commands to be polled, on virtual time.
    ready: Mutex<VecDeque<Arc<Task>>>,
    /// Disarm callbacks to be run by the loop of a simulation.
    pending_hooks: Mutex<VecDeque<(u64, Vec<Arc<Callback>>)>>,
    /// Reports of islands in a replay, until the journal says that they were processed.
    reports: Mutex<Sorted<usize, VecDeque<Report>>>,
    faults: Mutex<Faults>,
    safety_errors: Mutex<SafetyErrors>,
    /// A sensor or a service got an order, on virtual time.
    has_orders: AtomicBool,
    /// Tells sensors and services to stop.
    stop: StopSignal,
    islands: OnceLock<Box<dyn Islands>>,
    /// Weak, since the host has the control state.
    host: OnceLock<Weak<dyn Host>>,
    /// Called with the parameters that are set, under the lock: in the order in which they are.
    on_parameters: OnceLock<OnParameters>,
}

type OnParameters = Box<dyn Fn(&[ParameterEntry]) + Send + Sync>;

/// The control state's part of a report.
pub(crate) struct Summary {
    pub(crate) commands: Vec<CommandStatistics>,
    pub(crate) state: &'static str,
    pub(crate) safety: Safety,
    /// The newest faults.
    pub(crate) faults: Vec<ReportedFault>,
    pub(crate) all_faults: u64,
    pub(crate) safety_errors: Vec<ReportedSafetyError>,
    pub(crate) logger_panics: u64,
    pub(crate) waker_panics: u64,
}

/// The destination of entries for estimators.
pub(crate) trait Islands: Send + Sync {
    /// Adds an entry. Drop the returned value without the lock: it may be the last owner of the wiring.
    fn post(&self, estimator: usize, now: MonotonicTime, entry: NodeEntry) -> Option<Wired>;
}

/// Keeps a robot's wiring alive.
pub(crate) type Wired = Arc<dyn std::any::Any + Send + Sync>;

/// A time limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Limit {
    /// The `timeout` of an execution.
    Execution(u64),
    /// Time for which an arming command waits for cancelled ones.
    Arming,
    /// Time that disarm callbacks may take.
    Disarming(u64),
    /// Time that disarm callbacks outside of a disarming may take.
    Apart(Key),
}

/// Names some callbacks that run together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key(u64);

/// The control state's lock.
type StateGuard<'a> = MutexGuard<'a, State>;

struct State {
    machine: Machine,
    /// Executions in the order of their numbers.
    executions: Vec<RunningCommand>,
    statistics: Vec<CommandStatistics>,
    next_id: u64,
    parameters: ParameterValues,
    bound: Vec<Bound>,
    hooks: Hooks,
    budgets: Budgets,
    health: Vec<Health>,
    components: Vec<Supervised>,
    disarming: Option<Disarming>,
    /// Disarm callbacks that run outside of a disarming.
    apart: Vec<Apart>,
    next_apart: u64,
    /// Commands that arm the robot, whose code has ended while something is being made safe.
    held: Vec<EndedCode>,
    /// Cancelled commands whose code has returned since, which others wait for that arm the robot.
    held_lingering: Vec<u64>,
    /// The outcome of the last disarming.
    last_disarm: Result<(), DisarmError>,
    /// Number of times that a disarming was requested. A caller that has been waiting to arm the robot since before then gives up.
    disarms: u64,
    /// Number of disarmings that have begun.
    generation: u64,
    /// The robot has started: a thread keeps time.
    has_begun: bool,
    /// Sensors and services whose threads have not ended.
    sources: usize,
    is_stopping: bool,
    /// The journal and the last report are complete: later entries are neither written nor published.
    has_ended: bool,
    /// The last set of parameters is being stored: no other is accepted.
    parameters_are_final: bool,
}

/// An execution of a command.
struct RunningCommand {
    id: u64,
    /// The number of the command.
    command: usize,
    /// The name of the caller who asked for it, for its events.
    asked_by: String,
    health: Option<HealthTransition>,
    slot: Arc<Slot>,
    caller: Caller,
    started: MonotonicTime,
    /// The last that its code has published.
    progress: Option<DynamicMessage>,
    /// `None` in a replay.
    task: Option<Arc<Task>>,
    phase: Phase,
}

/// The phase of an execution.
enum Phase {
    Running,
    /// The code has succeeded; the execution is disarming the robot.
    Disarming(Option<Value>, Option<&'static str>),
    /// The code has succeeded; the execution arms the robot once cancelled commands are gone.
    Arming(Option<Value>, Option<&'static str>),
    /// The execution was cancelled or has timed out, and its code has not returned yet.
    Lingering,
}

/// The published health of an estimator, and how often it was lost.
#[derive(Clone, Copy, Debug, Default)]
struct Health {
    state: HealthState,
    epoch: u32,
}

/// A component whose options are bound to parameters.
struct Bound {
    path: &'static str,
    parameters: &'static [usize],
    check: Arc<Check>,
    target: BindTarget,
}

/// A sensor, a service or an actuator with its supervisor.
struct Supervised {
    path: &'static str,
    supervisor: Supervisor,
    order: Box<dyn Fn(ComponentOrder) + Send + Sync>,
}

/// An order from a supervisor to a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ComponentOrder {
    /// Restart.
    Restart,
    /// Stay stopped.
    GiveUp,
}

/// The robot is being disarmed.
struct Disarming {
    generation: u64,
    force: bool,
    /// `true` if the disarming ends in `error`, whatever the callbacks return.
    to_error: bool,
    /// The execution that disarms it.
    by: Option<u64>,
    /// The caller that disarms it.
    asked_by: Option<String>,
    /// The numbers and paths of callbacks that have not returned, each as often as it is to run.
    left: Vec<(u64, &'static str)>,
    /// Outcome, for callers that wait for it.
    outcome: Arc<OnceLock<Result<(), DisarmError>>>,
    errors: Vec<SafetyError>,
}

/// Control state of a robot that it does not keep alive.
#[derive(Clone)]
pub(crate) struct WeakControl(Weak<Inner>);
