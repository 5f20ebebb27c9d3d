//! Commands: which may start, how they go on, how they end.

use super::changes::Change;
use super::{Control, GOES_ON, State, Waiting};
use crate::control::commands::{CommandStatistics, Refusal, RefusalReason};
use crate::control::event::CommandPhase;
use crate::control::execution::{CommandError, Execution, Slot};
use crate::control::safety::Safety;
use crate::control::state::IDLE;
use crate::control::tasks::{Sleeper, Task, Value, lock};
use crate::control::{CategoryDeclaration, CommandContext, CommandDeclaration, Outcome, Role};
use crate::journal::Event;
use crate::node::HealthTransition;
use crate::time::MonotonicTime;
use std::any::Any;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Why a command is started.
pub(super) enum Cause {
    /// Somebody asked for it, with arguments or with the default ones.
    Caller(Option<Box<dyn Any + Send>>),
    /// A change of health.
    Health(HealthTransition),
}

impl Control {
    pub(crate) fn state(&self) -> &'static str {
        lock(&self.0.state).machine.state()
    }

    pub(crate) fn statistics(&self) -> Vec<CommandStatistics> {
        lock(&self.0.state).statistics.clone()
    }

    pub(in crate::control) fn sleeper(&self) -> Sleeper {
        self.0.sleeper.clone()
    }

    /// Starts a command for a caller who knows the type of its result.
    pub(crate) fn execute<T: 'static>(
        &self,
        number: usize,
        arguments: Box<dyn Any + Send>,
        now: MonotonicTime,
    ) -> Result<Execution<T>, Refusal> {
        self.start(number, Cause::Caller(Some(arguments)), now).map(Execution::new)
    }

    /// Asks for a command again, with its default arguments; one that was refused is refused again.
    pub(crate) fn replay(&self, number: usize, now: MonotonicTime) {
        drop(self.start(number, Cause::Caller(None), now));
    }

    /// That all commands could start with their options as they are; else the path of one, and why not.
    pub(crate) fn check_commands(&self) -> Result<(), (&'static str, String)> {
        let parameters = self.parameters();
        self.0.commands.iter().zip(self.0.declared.commands).try_for_each(|(command, declared)| {
            command.0.check(&parameters).map_err(|message| (declared.path, message))
        })
    }

    /// Starts a command, or says why not. It runs at the next [`Self::drive`].
    pub(super) fn start(&self, number: usize, cause: Cause, now: MonotonicTime) -> Result<Arc<Slot>, Refusal> {
        let (declared, prepared) = match (self.0.declared.commands.get(number), self.0.commands.get(number)) {
            (Some(declared), Some(prepared)) => (declared, &prepared.0),
            // Numbers and declarations come from one expansion.
            _ => {
                let category = CategoryDeclaration { name: "", concurrency: 0 };
                return Err(Refusal { command: "", reason: RefusalReason::Stopping, state: "", category });
            }
        };
        let _acting = self.act();
        let mut state = lock(&self.0.state);
        let (arguments, health) = match cause {
            Cause::Caller(arguments) => {
                self.write(now, Event::Command { command: number });
                (arguments, None)
            }
            Cause::Health(health) => (None, Some(health)),
        };
        if let Err(refusal) = self.may_start(&state, declared, prepared.role()) {
            self.refuse(&mut state, number, refusal.clone(), health, now);
            drop(state);
            self.tell();
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
        let deadline = declared.timeout_nanos.map(|timeout| now.plus_nanos(timeout));
        // It is among those that run before it begins: it takes its room, and whoever cancels all reaches it.
        let task = Arc::new(Task::new(id, number, health, deadline, self.0.bell.clone()));
        let slot = Arc::clone(&task.slot);
        state.tasks.push(Arc::clone(&task));
        state.note(now, Change::Command(number, id, CommandPhase::Started, health));
        state.note(now, Change::Machine(before, after, Some(declared.name)));
        drop(state);
        self.tell();
        // The user's code may run here already, and start other commands: no lock is held.
        self.go_on_at(now);
        let parameters = self.parameters();
        let context = CommandContext { name: declared.name, health, control: self.clone() };
        let started = crate::run::caught(|| prepared.start(arguments, &parameters, context));
        task.begin(started.unwrap_or_else(|failed| Box::pin(std::future::ready(Err(failed.fault)))));
        if lock(&self.0.state).is_stopping {
            // Nobody else drives commands any more.
            self.drive(now);
        }
        Ok(slot)
    }

    /// Counts a refusal and has it published.
    fn refuse(
        &self,
        state: &mut State,
        number: usize,
        refusal: Refusal,
        health: Option<HealthTransition>,
        now: MonotonicTime,
    ) {
        tracing::warn!(command = refusal.command, %refusal, "command refused");
        if let Some(statistics) = state.statistics.get_mut(number) {
            statistics.refused += 1;
            statistics.last_refusal = Some(refusal.clone());
        }
        state.note(now, Change::Command(number, 0, CommandPhase::Refused(refusal), health));
    }

    /// Refuses the command of a change of health since too many wait.
    pub(super) fn refuse_waiting(
        &self,
        state: &mut State,
        number: usize,
        health: HealthTransition,
        now: MonotonicTime,
    ) {
        if let Some(declared) = self.0.declared.commands.get(number) {
            let refusal = self.refusal(state, declared, RefusalReason::Busy);
            self.refuse(state, number, refusal, Some(health), now);
        }
    }

    fn refusal(&self, state: &State, declared: &CommandDeclaration, reason: RefusalReason) -> Refusal {
        let category = self.0.declared.categories.get(declared.category).copied();
        let category = category.unwrap_or(CategoryDeclaration { name: "default", concurrency: 1 });
        Refusal { command: declared.name, reason, state: state.machine.state(), category }
    }

    fn may_start(&self, state: &State, declared: &CommandDeclaration, role: Role) -> Result<(), Refusal> {
        let refuse = |reason| Err(self.refusal(state, declared, reason));
        if state.is_stopping {
            return refuse(RefusalReason::Stopping);
        }
        if matches!(state.machine.safety, Safety::Error | Safety::Disarming) {
            return refuse(RefusalReason::Safety);
        }
        if !declared.allowed(role, state.machine.state()) {
            return refuse(RefusalReason::State);
        }
        let in_category = |task: &&Arc<Task>| {
            self.0.declared.commands.get(task.command).is_some_and(|other| other.category == declared.category)
        };
        let running = state.tasks.iter().filter(in_category).count();
        let concurrency =
            self.0.declared.categories.get(declared.category).map_or(1, |category| category.concurrency);
        if running >= concurrency && !declared.cancel.includes(declared.category) {
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

    /// Does what can be done at `now`, each command once: time may go on before those are gone on with that wake themselves.
    pub(crate) fn drive(&self, now: MonotonicTime) {
        self.turn(now, |waiting| std::mem::take(waiting).into());
    }

    /// Does again what a journal says was done at `now`.
    pub(crate) fn replay_drive(&self, now: MonotonicTime, health: &[HealthTransition], given_up: &[&'static str]) {
        let is_same = |waiting: &Waiting| match waiting {
            Waiting::Start(transition, _) => health.contains(transition),
            Waiting::GiveUp(path) => given_up.contains(path),
        };
        self.turn(now, |waiting| {
            let (mut taken, left): (Vec<_>, Vec<_>) = std::mem::take(waiting).into_iter().partition(is_same);
            *waiting = left.into();
            // Several islands may have left theirs in another order.
            taken.sort_by_key(|waiting| match waiting {
                Waiting::Start(transition, _) => health.iter().position(|other| other == transition),
                Waiting::GiveUp(_) => None,
            });
            taken
        });
    }

    /// Starts what `take` takes of what waits, and goes on once with every command that can.
    fn turn(&self, now: MonotonicTime, take: impl FnOnce(&mut VecDeque<Waiting>) -> Vec<Waiting>) {
        let _acting = self.act();
        self.go_on_at(now);
        self.0.sleeper.advance(now);
        let waiting = {
            let mut state = lock(&self.0.state);
            let waiting = take(&mut state.waiting);
            self.0.has_waiting.store(!state.waiting.is_empty(), Ordering::Release);
            if self.0.journal.is_some() && (!waiting.is_empty() || state.tasks.iter().any(|task| task.is_due(now)))
            {
                let (mut health, mut given_up) = (Vec::new(), Vec::new());
                for waiting in &waiting {
                    match waiting {
                        Waiting::Start(transition, _) => health.push(*transition),
                        Waiting::GiveUp(path) => given_up.push(*path),
                    }
                }
                self.write(now, Event::Drive { health, given_up });
            }
            waiting
        };
        for waiting in waiting {
            match waiting {
                // A refusal is counted and published.
                Waiting::Start(transition, command) => drop(self.start(command, Cause::Health(transition), now)),
                Waiting::GiveUp(path) => self.carry_out_giving_up(path, now),
            }
        }
        let due: Vec<_> = lock(&self.0.state).tasks.iter().filter(|task| task.is_due(now)).cloned().collect();
        for task in due {
            let before = GOES_ON.replace(true);
            let polled = task.poll(now, self.0.clock.is_virtual());
            GOES_ON.set(before);
            if let Some(result) = polled {
                self.finish(&task, result, now);
            }
        }
    }

    /// From now on it is `now` for all commands.
    fn go_on_at(&self, now: MonotonicTime) {
        self.0.moment_nanos.fetch_max(now.as_nanos(), Ordering::AcqRel);
    }

    /// Waits until there may be something to drive, `longest` at most.
    pub(crate) fn wait(&self, longest: Duration) {
        self.0.bell.wait(longest);
    }

    pub(crate) fn ring(&self) {
        self.0.bell.ring();
    }

    /// Cancels what runs; nothing is started any more. The robot is disarmed. Gives the paths of the commands that do not
    /// come back from their code on another thread; their callers are told all the same.
    pub(crate) fn stop(&self, now: MonotonicTime) -> Vec<&'static str> {
        {
            let mut state = lock(&self.0.state);
            if !state.is_stopping {
                self.write(now, Event::Stop);
            }
            state.is_stopping = true;
            state.tasks.iter().for_each(|task| task.cancel());
        }
        self.drive(now);
        let tasks = lock(&self.0.state).tasks.clone();
        let left = tasks.iter().filter(|task| task.has_begun());
        let left = left.inspect(|task| task.slot.set(Err(CommandError::Cancelled)));
        let left = left.filter_map(|task| self.0.declared.commands.get(task.command)).map(|command| command.path);
        let left = left.collect();
        self.wait_for_disarm();
        if self.safety() == Safety::Armed {
            self.disarm_except(None, None, false, now);
        }
        left
    }

    fn finish(&self, task: &Task, result: Result<Outcome<Value>, CommandError>, now: MonotonicTime) {
        let Some(declared) = self.0.declared.commands.get(task.command) else { return };
        let role = self.0.commands.get(task.command).map_or(Role::Plain, |command| command.0.role());
        let mut result = result.and_then(|outcome| self.checked(outcome));
        if result.is_ok() && role == Role::Disarming {
            self.disarm_except(Some(task.id), Some(declared.name), false, now);
        }
        let mut state = lock(&self.0.state);
        let before = state.machine;
        state.tasks.retain(|other| other.id != task.id);
        state.machine.running = state.machine.running.saturating_sub(1);
        // Whoever has disarmed the robot meanwhile has cancelled it.
        let is_overruled = role == Role::Arming && (task.is_cancelled() || state.is_stopping);
        let overruled =
            (is_overruled && result.is_ok()).then(|| std::mem::replace(&mut result, Err(CommandError::Cancelled)));
        if let Ok(outcome) = &result {
            if role == Role::Arming && state.machine.safety == Safety::Disarmed {
                state.machine.safety = Safety::Armed;
                state.machine.resting = IDLE;
            }
            if let Some(next) = outcome.next_state {
                state.machine.resting = next;
            }
        }
        let phase = match &result {
            Ok(_) => CommandPhase::Succeeded,
            Err(CommandError::Failed(message)) => CommandPhase::Failed(message.clone()),
            Err(CommandError::TimedOut) => CommandPhase::TimedOut,
            Err(CommandError::Cancelled) => CommandPhase::Cancelled,
        };
        if let Some(statistics) = state.statistics.get_mut(task.command) {
            match &phase {
                CommandPhase::Succeeded => statistics.succeeded += 1,
                CommandPhase::Failed(_) => statistics.failed += 1,
                CommandPhase::TimedOut => statistics.timed_out += 1,
                CommandPhase::Cancelled => statistics.cancelled += 1,
                CommandPhase::Started | CommandPhase::Refused(_) => {}
            }
        }
        let after = state.machine;
        state.note(now, Change::Command(task.command, task.id, phase, task.health));
        state.note(now, Change::Machine(before, after, Some(declared.name)));
        drop(state);
        // What a command gave may do anything when it is dropped.
        drop(overruled);
        self.tell();
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
}
