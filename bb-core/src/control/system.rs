//! The state of the robot as a whole: safety, operational state, commands that run, parameters.
//!
//! Whoever needs something done says so from any thread and goes on: a change of health leaves its command in a list.
//! `Control::drive` does what is to be done, on the thread that drives commands (in a simulation, the caller's).

mod arming;
mod changes;
mod commands;
mod parameters;

use self::changes::Change;
use super::commands::CommandStatistics;
use super::event::{CommandEvent, ParameterChange, SafetyTransition, StateTransition};
use super::parameters::{ParameterDeclaration, ParameterValues};
use super::safety::{Hooks, SafetyError};
use super::state::Machine;
use super::tasks::{Bell, Sleeper, Task, lock};
use super::{CategoryDeclaration, CommandDeclaration, Prepared};
use crate::message::Origin;
use crate::node::HealthTransition;
use crate::pubsub::{AnyTopic, Topic};
use crate::time::Clock;
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

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
    parameters: Mutex<ParameterValues>,
    bound: Mutex<Vec<Bound>>,
    hooks: Mutex<Hooks>,
    sleeper: Sleeper,
    bell: Bell,
    /// Whether `State::waiting` holds anything.
    has_waiting: AtomicBool,
}

struct State {
    machine: Machine,
    tasks: Vec<Arc<Task>>,
    waiting: VecDeque<Waiting>,
    statistics: Vec<CommandStatistics>,
    next_id: u64,
    is_stopping: bool,
    /// What is to be published, in the order in which it happened.
    changes: VecDeque<Change>,
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
        self.publish(&self.0.topics.health, transition);
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
            self.refuse_waiting(&mut state, command, health);
        }
        state.waiting.push_back(waiting);
        self.0.has_waiting.store(true, Ordering::Release);
        drop(state);
        self.tell();
        self.0.bell.ring();
    }

    pub(crate) fn topics(&self) -> &SystemTopics {
        &self.0.topics
    }
}

impl fmt::Debug for Control {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Control").field("state", &self.state()).finish_non_exhaustive()
    }
}
