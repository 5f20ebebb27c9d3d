//! The state of the robot as a whole: safety, operational state, commands that run, parameters.
//!
//! Whoever needs something done says so from any thread and goes on: a change of health leaves its command in a list.
//! [`Control::drive`] does what is to be done, on the thread that drives commands (in a simulation, the caller's).

use super::commands::{AnyCommand, CommandStatistics, Refusal, RefusalReason};
use super::event::{CommandEvent, CommandPhase, ParameterChange, SafetyTransition, StateTransition};
use super::execution::{CommandError, Execution, Slot};
use super::parameters::{ParameterDeclaration, ParameterError, ParameterValue, ParameterValues};
use super::safety::{Hook, Safety, SafetyError, disarm, disarm_in_order};
use super::state::{IDLE, Machine};
use super::tasks::{Bell, Sleeper, Task, Value, lock};
use super::{CategoryDeclaration, CommandContext, CommandDeclaration, Outcome, Prepared, Role};
use crate::message::{Origin, Payload, Stamp};
use crate::node::HealthTransition;
use crate::pubsub::{AnyTopic, Topic};
use crate::time::{Clock, MonotonicTime};
use std::any::Any;
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
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
    /// Held while a command starts, so that two at once do not both find room.
    starting: Mutex<()>,
    parameters: Mutex<ParameterValues>,
    bound: Mutex<Vec<Bound>>,
    hooks: Mutex<Vec<(&'static str, Hook)>>,
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
    check: Box<dyn Fn(&ParameterValues) -> Result<(), String> + Send>,
    notify: Box<dyn Fn() + Send>,
}

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
        };
        let control = Self(Arc::new(Inner {
            declared,
            topics,
            clock,
            origin,
            commands: commands.into(),
            state: Mutex::new(state),
            starting: Mutex::new(()),
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

    // Parameters

    pub(crate) fn parameters(&self) -> ParameterValues {
        lock(&self.0.parameters).clone()
    }

    pub(crate) fn parameter_at(&self, path: &str) -> Option<ParameterValue> {
        let number = self.0.declared.parameters.iter().position(|parameter| parameter.path == path)?;
        self.parameters().0.get(number).cloned()
    }

    pub(crate) fn set_parameter_at(&self, path: &str, value: ParameterValue) -> Result<(), ParameterError> {
        match self.0.declared.parameters.iter().position(|parameter| parameter.path == path) {
            Some(number) => self.set_parameter(number, value),
            None => Err(ParameterError { path: path.to_owned(), message: "no such parameter is declared".into() }),
        }
    }

    /// Sets a parameter, unless it or the options of a component bound to it would be out of range.
    pub(crate) fn set_parameter(&self, number: usize, value: ParameterValue) -> Result<(), ParameterError> {
        let Some(declared) = self.0.declared.parameters.get(number) else { return Ok(()) };
        declared.check(&value)?;
        let bound = lock(&self.0.bound);
        let from = {
            let mut values = lock(&self.0.parameters);
            let mut new = values.0.to_vec();
            let Some(slot) = new.get_mut(number) else { return Ok(()) };
            let from = std::mem::replace(slot, value.clone());
            let new = ParameterValues(new.into());
            for component in bound.iter().filter(|component| component.parameters.contains(&number)) {
                (component.check)(&new).map_err(|message| ParameterError {
                    path: declared.path.to_owned(),
                    message: format!("{} would refuse it: {message}", component.path),
                })?;
            }
            *values = new;
            from
        };
        for component in bound.iter().filter(|component| component.parameters.contains(&number)) {
            (component.notify)();
        }
        drop(bound);
        if let Some(topic) = self.0.topics.parameters.get(number) {
            self.publish(topic, ParameterChange { path: declared.path, from, to: value });
        }
        Ok(())
    }

    /// Remembers that the options of a component are bound to parameters.
    pub(crate) fn bind(
        &self,
        path: &'static str,
        parameters: &'static [usize],
        check: impl Fn(&ParameterValues) -> Result<(), String> + Send + 'static,
        notify: impl Fn() + Send + 'static,
    ) {
        if !parameters.is_empty() {
            let bound = Bound { path, parameters, check: Box::new(check), notify: Box::new(notify) };
            lock(&self.0.bound).push(bound);
        }
    }

    // Safety

    pub(crate) fn safety(&self) -> Safety {
        lock(&self.0.state).machine.safety
    }

    /// Arms the robot, unless it is in `error`.
    pub(crate) fn arm(&self) -> bool {
        let mut state = lock(&self.0.state);
        let before = state.machine;
        if before.safety == Safety::Disarmed && !state.is_stopping {
            state.machine.safety = Safety::Armed;
            state.machine.resting = IDLE;
        }
        let after = state.machine;
        drop(state);
        self.publish_changes(before, after, None);
        after.safety == Safety::Armed
    }

    /// Disarms the robot: commands are cancelled, and whoever owns hardware makes it safe. True if all could; else the
    /// safety state is `error`, out of which `force` leads even if something still fails.
    pub(crate) fn disarm(&self, force: bool) -> bool {
        self.disarm_except(None, None, force)
    }

    fn disarm_except(&self, except: Option<u64>, command: Option<&'static str>, force: bool) -> bool {
        let mut state = lock(&self.0.state);
        let before = state.machine;
        match before.safety {
            Safety::Disarming => return false,
            Safety::Error if !force => return false,
            Safety::Disarmed if !force => return true,
            _ => {}
        }
        state.machine.safety = Safety::Disarming;
        let between = state.machine;
        state.tasks.iter().filter(|task| Some(task.id) != except).for_each(|task| task.cancel());
        drop(state);
        self.publish_changes(before, between, command);
        let hooks = lock(&self.0.hooks).clone();
        let errors = if self.0.clock.is_virtual() { disarm_in_order(hooks) } else { disarm(hooks) };
        let is_safe = errors.is_empty();
        let after = {
            let mut state = lock(&self.0.state);
            state.machine.safety = if is_safe || force { Safety::Disarmed } else { Safety::Error };
            state.machine
        };
        for error in errors {
            self.report(error);
        }
        self.publish_changes(between, after, command);
        is_safe
    }

    /// A component has failed too often: the robot is disarmed, and in `error`.
    pub(crate) fn give_up(&self, path: &'static str) {
        self.leave(Waiting::GiveUp(path));
    }

    fn carry_out_giving_up(&self, path: &'static str) {
        self.report(SafetyError { path, message: "failed too often, and is not started anew any more".into() });
        self.disarm(false);
        let (before, after) = {
            let mut state = lock(&self.0.state);
            let before = state.machine;
            state.machine.safety = Safety::Error;
            (before, state.machine)
        };
        self.publish_changes(before, after, None);
    }

    fn report(&self, error: SafetyError) {
        tracing::error!(component = error.path, message = error.message, "safety error");
        self.publish(&self.0.topics.safety_error, error);
    }

    /// Remembers what makes hardware safe.
    pub(crate) fn on_disarm(&self, path: &'static str, hook: Hook) {
        lock(&self.0.hooks).push((path, hook));
    }

    // Health

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
        if state.waiting.len() == MAX_WAITING {
            state.waiting.pop_front();
        }
        state.waiting.push_back(waiting);
        self.0.has_waiting.store(true, Ordering::Release);
        drop(state);
        self.0.bell.ring();
    }

    // Commands

    pub(crate) fn state(&self) -> &'static str {
        lock(&self.0.state).machine.state()
    }

    pub(crate) fn statistics(&self) -> Vec<CommandStatistics> {
        lock(&self.0.state).statistics.clone()
    }

    pub(super) fn sleeper(&self) -> Sleeper {
        self.0.sleeper.clone()
    }

    /// Starts a command for a caller who knows the type of its result.
    pub(crate) fn execute<T: 'static>(
        &self,
        number: usize,
        arguments: Box<dyn Any + Send>,
    ) -> Result<Execution<T>, Refusal> {
        self.start(number, Some(arguments), None).map(Execution::new)
    }

    /// That all commands could start with their options as they are; else the path of one, and why not.
    pub(crate) fn check_commands(&self) -> Result<(), (&'static str, String)> {
        let parameters = self.parameters();
        self.0.commands.iter().zip(self.0.declared.commands).try_for_each(|(command, declared)| {
            command.0.check(&parameters).map_err(|message| (declared.path, message))
        })
    }

    /// Starts a command, or says why not. It runs at the next [`Self::drive`].
    pub(super) fn start(
        &self,
        number: usize,
        arguments: Option<Box<dyn Any + Send>>,
        health: Option<HealthTransition>,
    ) -> Result<Arc<Slot>, Refusal> {
        let (declared, prepared) = match (self.0.declared.commands.get(number), self.0.commands.get(number)) {
            (Some(declared), Some(prepared)) => (declared, &prepared.0),
            // Numbers and declarations come from one expansion.
            _ => {
                let category = CategoryDeclaration { name: "", concurrency: 0 };
                return Err(Refusal { command: "", reason: RefusalReason::Stopping, state: "", category });
            }
        };
        let _starting = lock(&self.0.starting);
        let mut state = lock(&self.0.state);
        if let Err(refusal) = self.may_start(&state, declared, &**prepared) {
            if let Some(statistics) = state.statistics.get_mut(number) {
                statistics.refused += 1;
                statistics.last_refusal = Some(refusal.clone());
            }
            drop(state);
            tracing::warn!(command = declared.name, %refusal, "command refused");
            self.command_event(number, 0, CommandPhase::Refused(refusal.clone()), health);
            return Err(refusal);
        }
        let cancelled = state.tasks.iter().filter(|task| {
            self.0.declared.commands.get(task.command).is_some_and(|other| declared.cancel.includes(other.category))
        });
        cancelled.for_each(|task| task.cancel());
        let before = state.machine;
        let id = state.next_id;
        state.next_id += 1;
        state.machine.running += 1;
        if let Some(statistics) = state.statistics.get_mut(number) {
            statistics.started += 1;
        }
        let after = state.machine;
        let context =
            CommandContext { name: declared.name, health, clock: self.0.clock.clone(), control: self.clone() };
        let deadline = declared.timeout_nanos.map(|timeout| self.0.clock.now().plus_nanos(timeout));
        let parameters = self.parameters();
        drop(state);
        // The user's code may run here already, so no lock is held.
        let started = crate::run::caught(|| prepared.start(arguments, &parameters, context));
        let future = started.unwrap_or_else(|failed| Box::pin(std::future::ready(Err(failed.fault))));
        let task = Arc::new(Task::new(id, number, health, deadline, future, self.0.bell.clone()));
        let slot = Arc::clone(&task.slot);
        lock(&self.0.state).tasks.push(task);
        self.command_event(number, id, CommandPhase::Started, health);
        self.publish_changes(before, after, Some(declared.name));
        self.0.bell.ring();
        Ok(slot)
    }

    fn may_start(
        &self,
        state: &State,
        declared: &CommandDeclaration,
        prepared: &dyn AnyCommand,
    ) -> Result<(), Refusal> {
        let category = self.0.declared.categories.get(declared.category).copied();
        let category = category.unwrap_or(CategoryDeclaration { name: "default", concurrency: 1 });
        let refuse =
            |reason| Err(Refusal { command: declared.name, reason, state: state.machine.state(), category });
        if state.is_stopping {
            return refuse(RefusalReason::Stopping);
        }
        if matches!(state.machine.safety, Safety::Error | Safety::Disarming) {
            return refuse(RefusalReason::Safety);
        }
        if !declared.allowed(prepared.role(), state.machine.state()) {
            return refuse(RefusalReason::State);
        }
        let in_category = |task: &&Arc<Task>| {
            self.0.declared.commands.get(task.command).is_some_and(|other| other.category == declared.category)
        };
        let running = state.tasks.iter().filter(in_category).count();
        if running >= category.concurrency && !declared.cancel.includes(declared.category) {
            return refuse(RefusalReason::Busy);
        }
        Ok(())
    }

    /// When a command is to be gone on with; `now` if one can be at once.
    pub(crate) fn next_due(&self, now: MonotonicTime) -> Option<MonotonicTime> {
        let state = lock(&self.0.state);
        if !state.waiting.is_empty() || state.tasks.iter().any(|task| task.is_due(now)) {
            return Some(now);
        }
        state.tasks.iter().filter_map(|task| task.deadline).chain(self.0.sleeper.next()).min()
    }

    /// Whether there is anything that [`Self::drive`] looks after: the one question in a simulation's every step.
    pub(crate) fn is_quiet(&self) -> bool {
        !self.0.has_waiting.load(Ordering::Acquire) && lock(&self.0.state).tasks.is_empty()
    }

    /// Does all that can be done at `now`.
    pub(crate) fn drive(&self, now: MonotonicTime) {
        loop {
            self.0.sleeper.advance(now);
            let (waiting, due) = {
                let mut state = lock(&self.0.state);
                let waiting = std::mem::take(&mut state.waiting);
                self.0.has_waiting.store(false, Ordering::Release);
                let due = state.tasks.iter().filter(|task| task.is_due(now)).cloned().collect::<Vec<_>>();
                (waiting, due)
            };
            if waiting.is_empty() && due.is_empty() {
                return;
            }
            for waiting in waiting {
                match waiting {
                    // A refusal is counted and published.
                    Waiting::Start(transition, command) => drop(self.start(command, None, Some(transition))),
                    Waiting::GiveUp(path) => self.carry_out_giving_up(path),
                }
            }
            for task in due {
                if let Some(result) = task.poll(now) {
                    self.finish(&task, result);
                }
            }
        }
    }

    /// Waits until there may be something to drive, `longest` at most.
    pub(crate) fn wait(&self, longest: Duration) {
        self.0.bell.wait(longest);
    }

    pub(crate) fn ring(&self) {
        self.0.bell.ring();
    }

    /// Cancels what runs; nothing is started any more. The robot is disarmed.
    pub(crate) fn stop(&self) {
        {
            let mut state = lock(&self.0.state);
            state.is_stopping = true;
            state.tasks.iter().for_each(|task| task.cancel());
        }
        self.drive(self.0.clock.now());
        if self.safety() == Safety::Armed {
            self.disarm(false);
        }
    }

    fn finish(&self, task: &Task, result: Result<Outcome<Value>, CommandError>) {
        let Some(declared) = self.0.declared.commands.get(task.command) else { return };
        let role = self.0.commands.get(task.command).map_or(Role::Plain, |command| command.0.role());
        let result = result.and_then(|outcome| self.checked(outcome));
        if result.is_ok() && role == Role::Disarming {
            self.disarm_except(Some(task.id), Some(declared.name), false);
        }
        let phase = match &result {
            Ok(_) => CommandPhase::Succeeded,
            Err(CommandError::Failed(message)) => CommandPhase::Failed(message.clone()),
            Err(CommandError::TimedOut) => CommandPhase::TimedOut,
            Err(CommandError::Cancelled) => CommandPhase::Cancelled,
        };
        let (before, after) = {
            let mut state = lock(&self.0.state);
            let before = state.machine;
            state.tasks.retain(|other| other.id != task.id);
            state.machine.running = state.machine.running.saturating_sub(1);
            if let Ok(outcome) = &result {
                if role == Role::Arming && state.machine.safety == Safety::Disarmed {
                    state.machine.safety = Safety::Armed;
                    state.machine.resting = IDLE;
                }
                if let Some(next) = outcome.next_state {
                    state.machine.resting = next;
                }
            }
            if let Some(statistics) = state.statistics.get_mut(task.command) {
                match &phase {
                    CommandPhase::Succeeded => statistics.succeeded += 1,
                    CommandPhase::Failed(_) => statistics.failed += 1,
                    CommandPhase::TimedOut => statistics.timed_out += 1,
                    CommandPhase::Cancelled => statistics.cancelled += 1,
                    CommandPhase::Started | CommandPhase::Refused(_) => {}
                }
            }
            (before, state.machine)
        };
        self.command_event(task.command, task.id, phase, task.health);
        self.publish_changes(before, after, Some(declared.name));
        task.slot.set(result.map(|outcome| outcome.value));
    }

    /// The state that a command names must be one.
    fn checked(&self, outcome: Outcome<Value>) -> Result<Outcome<Value>, CommandError> {
        match outcome.next_state {
            Some(next) if next != IDLE && !self.0.declared.states.contains(&next) => {
                Err(CommandError::Failed(format!("it names the next state `{next}`, which is not declared")))
            }
            _ => Ok(outcome),
        }
    }

    // What is seen

    fn publish_changes(&self, before: Machine, after: Machine, command: Option<&'static str>) {
        if before.safety != after.safety {
            let (from, to) = (before.safety, after.safety);
            tracing::info!(%from, %to, "safety changed");
            self.publish(&self.0.topics.safety, SafetyTransition { from, to });
        }
        if before.state() != after.state() {
            let (from, to) = (before.state(), after.state());
            tracing::info!(from, to, command, "state changed");
            self.publish(&self.0.topics.state, StateTransition { from, to, command });
        }
    }

    fn command_event(&self, number: usize, execution: u64, phase: CommandPhase, health: Option<HealthTransition>) {
        if let (Some(topic), Some(declared)) =
            (self.0.topics.commands.get(number), self.0.declared.commands.get(number))
        {
            tracing::debug!(command = declared.name, execution, ?phase, "command");
            self.publish(topic, CommandEvent { command: declared.name, execution, phase, health });
        }
    }

    fn publish<T: Payload>(&self, topic: &Topic<T>, payload: T) {
        let monotonic_time = self.0.clock.now();
        let wall_time = self.0.clock.wall_at(monotonic_time);
        let stamp = Stamp { monotonic_time, wall_time, origin: self.0.origin, ..Stamp::default() };
        topic.publish(&stamp.message(payload));
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
