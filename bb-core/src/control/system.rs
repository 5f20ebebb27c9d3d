//! The state of the robot as a whole: safety, operational state, commands that run, parameters.
//!
//! Whoever needs something done says so from any thread and goes on: a change of health leaves its command in a list.
//! `Control::drive` does what is to be done, on the thread that drives commands (in a simulation, the caller's).

mod arming;
mod commands;
mod parameters;

pub(crate) use parameters::Setter;

use super::commands::CommandStatistics;
use super::event::{CommandEvent, CommandPhase, ParameterChange, SafetyTransition, StateTransition};
use super::parameters::{ParameterDeclaration, ParameterValues};
use super::safety::{Hook, SafetyError};
use super::state::Machine;
use super::tasks::{Bell, Sleeper, Task, lock};
use super::{CategoryDeclaration, CommandDeclaration, Prepared};
use crate::journal::{Event, Journal};
use crate::message::{Origin, Payload, Stamp};
use crate::node::HealthTransition;
use crate::pubsub::{AnyTopic, Topic};
use crate::run::Directory;
use crate::time::{Clock, MonotonicTime};
use std::cell::Cell;
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

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
    pub(crate) commands: Box<[Topic<CommandEvent>]>,
    pub(crate) parameters: Box<[Topic<ParameterChange>]>,
}

impl SystemTopics {
    pub(crate) fn new(declared: Declared) -> Self {
        Self {
            state: Topic::new("state_machine"),
            safety: Topic::new("safety"),
            safety_error: Topic::new("safety/error"),
            health: Topic::new("health"),
            commands: declared.commands.iter().map(|command| Topic::new(command.path)).collect(),
            parameters: declared.parameters.iter().map(|parameter| Topic::new(parameter.path)).collect(),
        }
    }

    pub(crate) fn all(&self) -> Vec<&dyn AnyTopic> {
        let fixed: [&dyn AnyTopic; 4] = [&self.state, &self.safety, &self.safety_error, &self.health];
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
    acting: Mutex<()>,
    parameters: Mutex<ParameterValues>,
    bound: Mutex<Vec<Bound>>,
    hooks: Mutex<Vec<(&'static str, Hook)>>,
    sleeper: Sleeper,
    bell: Bell,
    /// Whether `State::waiting` holds anything.
    has_waiting: AtomicBool,
    /// Where topics and actuators are, once they are made.
    directory: OnceLock<Arc<dyn Directory>>,
    /// When commands go on: their time, so that a replay of them is the same.
    moment_nanos: AtomicI64,
    journal: Option<Journal>,
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
}

/// What was left to do.
enum Waiting {
    Start(HealthTransition, usize),
    GiveUp(&'static str),
}

/// Changes of health that wait for their commands; beyond it the oldest is refused.
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
        };
        let control = Self(Arc::new(Inner {
            declared,
            topics,
            clock,
            origin,
            commands: commands.into(),
            state: Mutex::new(state),
            acting: Mutex::new(()),
            parameters: Mutex::new(parameters),
            bound: Mutex::default(),
            hooks: Mutex::default(),
            sleeper: Sleeper::default(),
            bell: Bell::default(),
            has_waiting: AtomicBool::new(false),
            directory: OnceLock::new(),
            moment_nanos: AtomicI64::new(0),
            journal,
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

    /// Writes into the journal, if there is one.
    fn write(&self, now: MonotonicTime, event: Event) {
        if let Some(journal) = &self.0.journal {
            journal.write(now, event);
        }
    }

    /// Whoever does anything does it alone, so that two commands at once do not both find room, and a journal has an order.
    /// A command that does something while it goes on is in here already.
    fn act(&self) -> Acting<'_> {
        if IS_ACTING.get() {
            return Acting(None);
        }
        let guard = lock(&self.0.acting);
        IS_ACTING.set(true);
        Acting(Some(guard))
    }

    /// Who sets a parameter now: a command that goes on, or somebody outside.
    pub(crate) fn setter(&self) -> Setter {
        if IS_ACTING.get() { Setter::Command } else { Setter::Outside(self.0.clock.now()) }
    }

    /// When commands go on.
    pub(super) fn moment(&self) -> MonotonicTime {
        MonotonicTime::from_nanos(self.0.moment_nanos.load(Ordering::Acquire))
    }

    fn leave(&self, waiting: Waiting) {
        let mut state = lock(&self.0.state);
        if state.waiting.len() == MAX_WAITING {
            state.waiting.pop_front();
        }
        state.waiting.push_back(waiting);
        self.0.has_waiting.store(true, Ordering::Release);
        drop(state);
        self.0.bell.ring();
    }

    fn publish_changes(&self, before: Machine, after: Machine, command: Option<&'static str>, now: MonotonicTime) {
        if before.safety != after.safety {
            let (from, to) = (before.safety, after.safety);
            tracing::info!(%from, %to, "safety changed");
            self.publish(&self.0.topics.safety, SafetyTransition { from, to }, now);
        }
        if before.state() != after.state() {
            let (from, to) = (before.state(), after.state());
            tracing::info!(from, to, command, "state changed");
            self.publish(&self.0.topics.state, StateTransition { from, to, command }, now);
        }
    }

    fn command_event(
        &self,
        number: usize,
        execution: u64,
        phase: CommandPhase,
        health: Option<HealthTransition>,
        now: MonotonicTime,
    ) {
        if let (Some(topic), Some(declared)) =
            (self.0.topics.commands.get(number), self.0.declared.commands.get(number))
        {
            tracing::debug!(command = declared.name, execution, ?phase, "command");
            self.publish(topic, CommandEvent { command: declared.name, execution, phase, health }, now);
        }
    }

    fn publish<T: Payload>(&self, topic: &Topic<T>, payload: T, monotonic_time: MonotonicTime) {
        let wall_time = self.0.clock.wall_at(monotonic_time);
        let stamp = Stamp { monotonic_time, wall_time, origin: self.0.origin, ..Stamp::default() };
        topic.publish(&stamp.message(payload));
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

thread_local! {
    static IS_ACTING: Cell<bool> = const { Cell::new(false) };
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
