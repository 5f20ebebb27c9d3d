//! The state of the robot as a whole: safety, operational state, commands that run, parameters.
//!
//! Whoever needs something done says so from any thread and goes on: a change of health leaves its command in a list.
//! `Control::drive` does what is to be done, on the thread that drives commands (in a simulation, the caller's).

mod arming;
mod changes;
mod commands;
mod parameters;

use self::changes::Change;
pub(crate) use self::parameters::Setter;
use super::commands::CommandStatistics;
use super::event::{CommandEvent, ParameterChange, SafetyTransition, StateTransition};
use super::parameters::{ParameterDeclaration, ParameterValues};
use super::safety::{Hooks, SafetyError};
use super::state::Machine;
use super::tasks::{Bell, Sleeper, Task, lock};
use super::{CategoryDeclaration, CommandDeclaration, Prepared};
use crate::journal::{Event, Journal, JournalLine};
use crate::message::{Origin, Stamp};
use crate::node::HealthTransition;
use crate::pubsub::{AnyTopic, Registry, Topic};
use crate::run::Directory;
use crate::time::{Clock, MonotonicTime};
use std::cell::Cell;
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};
use std::time::Duration;

/// What `robot!` declares of all this.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Declared {
    pub(crate) states: &'static [&'static str],
    pub(crate) categories: &'static [CategoryDeclaration],
    pub(crate) commands: &'static [CommandDeclaration],
    pub(crate) parameters: &'static [ParameterDeclaration],
}

/// The topics that every robot has.
#[derive(Debug)]
pub struct SystemTopics {
    pub(crate) state: Topic<StateTransition>,
    pub(crate) safety: Topic<SafetyTransition>,
    pub(crate) safety_error: Topic<SafetyError>,
    pub(crate) health: Topic<HealthTransition>,
    pub(crate) journal: Topic<JournalLine>,
    pub(crate) commands: Box<[Topic<CommandEvent>]>,
    pub(crate) parameters: Box<[Topic<ParameterChange>]>,
    /// Topics made at run time.
    pub(crate) registry: Registry,
}

impl SystemTopics {
    pub(crate) fn new(declared: Declared) -> Self {
        Self {
            state: Topic::new("state_machine"),
            safety: Topic::new("safety"),
            safety_error: Topic::new("safety/error"),
            health: Topic::new("health"),
            journal: Topic::new("journal"),
            commands: declared.commands.iter().map(|command| Topic::new(command.path)).collect(),
            parameters: declared.parameters.iter().map(|parameter| Topic::new(parameter.path)).collect(),
            registry: Registry::default(),
        }
    }

    pub(crate) fn all(&self) -> Vec<&dyn AnyTopic> {
        let fixed: [&dyn AnyTopic; 5] =
            [&self.state, &self.safety, &self.safety_error, &self.health, &self.journal];
        let commands = self.commands.iter().map(|topic| topic as &dyn AnyTopic);
        fixed
            .into_iter()
            .chain(commands)
            .chain(self.parameters.iter().map(|topic| topic as &dyn AnyTopic))
            .collect()
    }
}

/// The robot as a whole. Clones are the same one.
#[derive(Clone)]
pub(crate) struct Control(Arc<Inner>);

struct Inner {
    declared: Declared,
    topics: Arc<SystemTopics>,
    clock: Clock,
    origin: Origin,
    commands: Box<[Prepared]>,
    state: Mutex<State>,
    parameters: Mutex<ParameterValues>,
    bound: Mutex<Vec<Bound>>,
    hooks: Mutex<Hooks>,
    sleeper: Sleeper,
    bell: Bell,
    /// Whether `State::waiting` holds anything.
    has_waiting: AtomicBool,
    /// Where topics and actuators are, once they are made.
    directory: OnceLock<Arc<dyn Directory>>,
    /// When commands go on: their time, so that a replay of them is the same.
    moment_nanos: AtomicI64,
    journal: Option<Journal>,
    /// See [`Control::act`].
    acting: Mutex<()>,
    /// What making hardware safe answers in a replay.
    replayed_answer: Mutex<Option<Vec<SafetyError>>>,
}

struct State {
    machine: Machine,
    tasks: Vec<Arc<Task>>,
    waiting: VecDeque<Waiting>,
    statistics: Vec<CommandStatistics>,
    next_id: u64,
    is_stopping: bool,
    /// What is to be published, in the order in which it happened.
    changes: VecDeque<(MonotonicTime, Change)>,
    /// Somebody publishes it.
    is_told: bool,
}

/// What was left to do.
enum Waiting {
    Start(HealthTransition, usize),
    GiveUp(&'static str),
}

/// Changes of health that wait for their commands; beyond it the oldest is refused. (That a component is given up is never
/// lost.)
const MAX_WAITING: usize = 1024;

/// A component whose options are bound to parameters.
struct Bound {
    path: &'static str,
    parameters: &'static [usize],
    check: Check,
    notify: Box<dyn Fn() + Send>,
}

/// Whether options would be valid with these parameters.
type Check = Box<dyn Fn(&ParameterValues) -> Result<(), String> + Send>;

impl Control {
    pub(crate) fn new(
        declared: Declared,
        topics: Arc<SystemTopics>,
        clock: Clock,
        origin: Origin,
        commands: Vec<Prepared>,
        parameters: ParameterValues,
        journal: Option<Journal>,
    ) -> Self {
        let statistics =
            |command: &CommandDeclaration| CommandStatistics { name: command.name, ..Default::default() };
        let state = State {
            machine: Machine::default(),
            tasks: Vec::new(),
            waiting: VecDeque::new(),
            statistics: declared.commands.iter().map(statistics).collect(),
            next_id: 1,
            is_stopping: false,
            changes: VecDeque::new(),
            is_told: false,
        };
        let control = Self(Arc::new(Inner {
            declared,
            topics,
            clock,
            origin,
            commands: commands.into(),
            state: Mutex::new(state),
            parameters: Mutex::new(parameters),
            bound: Mutex::default(),
            hooks: Mutex::default(),
            sleeper: Sleeper::default(),
            bell: Bell::default(),
            has_waiting: AtomicBool::new(false),
            directory: OnceLock::new(),
            moment_nanos: AtomicI64::new(0),
            journal,
            acting: Mutex::new(()),
            replayed_answer: Mutex::default(),
        }));
        for (number, command) in declared.commands.iter().enumerate() {
            let used = control.clone_weakly();
            let check = move |values: &ParameterValues| match used.upgrade() {
                Some(inner) => inner.commands.get(number).map_or(Ok(()), |command| command.0.check(values)),
                None => Ok(()),
            };
            let bound = control.0.commands.get(number).map_or(&[][..], |command| command.0.bound_to());
            // A command takes its options when it starts, so that nobody has to be told.
            control.bind(command.path, bound, check, || {});
        }
        control
    }

    fn clone_weakly(&self) -> std::sync::Weak<Inner> {
        Arc::downgrade(&self.0)
    }

    pub(crate) fn health_changed(&self, transition: HealthTransition, command: Option<usize>) {
        let HealthTransition { estimator, source, from, to, reason, time } = transition;
        tracing::info!(estimator, source, %from, %to, %reason, %time, "health changed");
        self.publish(&self.0.topics.health, transition, time);
        if let Some(command) = command {
            self.leave(Waiting::Start(transition, command));
        }
    }

    fn leave(&self, waiting: Waiting) {
        let mut state = lock(&self.0.state);
        let oldest = state.waiting.iter().position(|waiting| matches!(waiting, Waiting::Start(..)));
        if state.waiting.len() >= MAX_WAITING
            && let Some(Waiting::Start(health, command)) = oldest.and_then(|oldest| state.waiting.remove(oldest))
        {
            self.refuse_waiting(&mut state, command, health, health.time);
        }
        state.waiting.push_back(waiting);
        self.0.has_waiting.store(true, Ordering::Release);
        drop(state);
        self.tell();
        self.0.bell.ring();
    }

    /// Writes into the journal, if there is one.
    fn write(&self, now: MonotonicTime, event: Event) {
        if let Some(journal) = &self.0.journal {
            journal.write(now, event);
        }
    }

    /// With a journal, whoever does anything does it alone, so that it has an order. A command that does something while it
    /// goes on is in here already; and nobody waits long for one that does not come back from its code.
    fn act(&self) -> Acting<'_> {
        if self.0.journal.is_none() || IS_ACTING.get() {
            return Acting(None);
        }
        let start = std::time::Instant::now();
        loop {
            match self.0.acting.try_lock() {
                Ok(guard) => {
                    IS_ACTING.set(true);
                    return Acting(Some(guard));
                }
                Err(_) if start.elapsed() > LONGEST_ACT => return Acting(None),
                Err(_) => std::thread::sleep(Duration::from_micros(50)),
            }
        }
    }

    /// Who sets a parameter now: a command that goes on, or somebody outside.
    pub(crate) fn setter(&self) -> Setter {
        if GOES_ON.get() { Setter::Command } else { Setter::Outside(self.0.clock.now()) }
    }

    /// When commands go on.
    pub(super) fn moment(&self) -> MonotonicTime {
        MonotonicTime::from_nanos(self.0.moment_nanos.load(Ordering::Acquire))
    }

    /// The stamp of what is published now; at the time of the commands, if one of them publishes it.
    pub(crate) fn stamp(&self) -> Stamp {
        let monotonic_time = if GOES_ON.get() { self.moment() } else { self.0.clock.now() };
        let wall_time = self.0.clock.wall_at(monotonic_time);
        Stamp { monotonic_time, wall_time, origin: self.0.origin, ..Stamp::default() }
    }

    pub(crate) fn set_directory(&self, directory: Arc<dyn Directory>) {
        // It is set once.
        let _ = self.0.directory.set(directory);
    }

    pub(crate) fn directory(&self) -> Option<&Arc<dyn Directory>> {
        self.0.directory.get()
    }

    pub(crate) fn clock(&self) -> &Clock {
        &self.0.clock
    }

    pub(crate) fn topics(&self) -> &SystemTopics {
        &self.0.topics
    }
}

/// How long anything waits for its turn in the journal.
const LONGEST_ACT: Duration = Duration::from_millis(100);

thread_local! {
    static IS_ACTING: Cell<bool> = const { Cell::new(false) };
    /// A command goes on, on this thread.
    static GOES_ON: Cell<bool> = const { Cell::new(false) };
}

/// See [`Control::act`].
struct Acting<'a>(Option<MutexGuard<'a, ()>>);

impl Drop for Acting<'_> {
    fn drop(&mut self) {
        if self.0.is_some() {
            IS_ACTING.set(false);
        }
    }
}

impl fmt::Debug for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Control").field("state", &self.state()).finish_non_exhaustive()
    }
}
