//! Commands as callers see them: listing them, starting them, the reasons for refusing them, and those that hang.
//!
//! A start is one entry: the command is refused, or the ones that it cancels are settled and it has its number. Its code is called
//! afterwards, as an effect. What follows is in [`ending`](super::ending).

use super::command::Arguments;
use super::effects::Log;
use super::execution::{Execution, Slot, Task, UntypedExecution, Value};
use super::step::Step;
use super::{Control, Limit, Phase, RunningCommand};
use crate::component::{
    Bus, Caller, CommandContext, CommandControls, CommandInfo, DynamicExecution, ExecutionInfo,
};
use crate::declaration::{CommandDeclaration, Role};
use crate::event::{
    CategoryDeclaration, CommandEvent, CommandPhase, HealthTransition, Refusal, RefusalReason, Right, Safety,
};
use crate::fault::{Fault, lock};
use crate::journal::Event;
use crate::node::Mode;
use crate::pubsub::DynamicMessage;
use crate::schedule::Lane;
use crate::time::MonotonicTime;
use bb_message::__private::{did_you_mean, member_of, nearest_path};
use std::sync::Arc;
use std::time::Duration;

/// Executions whose code has not returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Hanging {
    /// The path of the command.
    pub(crate) path: &'static str,
    /// The number of the first of these executions.
    pub(crate) first: u64,
    /// Time for which its code has been running.
    pub(crate) duration: Duration,
}

/// No further command starts while this many cancelled executions have not returned from their code, and while twice as many have not
/// none that health starts. One that disarms always starts. The pool has as many threads for the latter two, and others for all other
/// commands. Executions that are not cancelled are bounded by the concurrency of their categories.
const MOST_LINGERING: usize = 256;

impl Control {
    /// Checks that all commands can start with their current options. The error names the path of one that cannot, and why.
    pub(crate) fn check_commands(&self) -> Result<(), (&'static str, String)> {
        let parameters = self.parameters();
        self.0.commands.iter().zip(self.0.declared.commands).try_for_each(|(command, declared)| {
            command.0.check(&parameters).map_err(|message| (declared.path, message))
        })
    }

    /// Starts a command for a caller who knows the type of its result.
    pub(crate) fn execute<T: 'static>(&self, number: usize, arguments: Arguments) -> Result<Execution<T>, Refusal> {
        let caller = Caller::PROGRAM.name().to_owned();
        self.request(self.step(), number, Some(arguments), caller).map(Execution::new)
    }

    /// Replays a request of a command.
    pub(crate) fn replay_command(&self, number: usize, caller: String) {
        // A command that was refused is refused again.
        let _ = self.request(self.step(), number, None, caller);
    }

    fn request(
        &self,
        mut step: Step<'_>,
        number: usize,
        arguments: Option<Arguments>,
        caller: String,
    ) -> Result<Arc<Slot>, Refusal> {
        step.line(Event::Command { command: number, caller: caller.clone() });
        let started = step.start(number, arguments, caller, None);
        step.finish();
        started
    }

    /// The first execution of each command whose code has been running for `longest` or longer.
    pub(crate) fn hanging(&self, now: MonotonicTime, longest: Duration) -> Vec<Hanging> {
        let state = self.lock();
        let mut hanging: Vec<Hanging> = Vec::new();
        for execution in &state.executions {
            let Some(entered) = execution.task.as_ref().and_then(|task| task.entered_at()) else { continue };
            let Some(declared) = self.0.declared.commands.get(execution.command) else { continue };
            let duration = now.duration_since(entered);
            if duration >= longest && hanging.iter().all(|other| other.path != declared.path) {
                hanging.push(Hanging { path: declared.path, first: execution.id, duration });
            }
        }
        hanging
    }

    pub(super) fn result_json(&self, command: usize, result: Value) -> Result<String, Fault> {
        match self.0.commands.get(command) {
            Some(command) => command.0.result_json(result),
            None => Err(Fault::new("there is no such command")),
        }
    }

    pub(super) fn category(&self, declared: &CommandDeclaration) -> CategoryDeclaration {
        let category = self.0.declared.categories.get(declared.category).copied();
        category.unwrap_or(CategoryDeclaration { name: "default", concurrency: 1 })
    }

    /// Drops the futures of cancelled commands at once, on virtual time.
    pub(super) fn drop_cancelled(&self) {
        let lingering: Vec<_> = {
            let state = self.lock();
            let lingering = state.executions.iter().filter(|execution| execution.is_lingering());
            lingering.filter_map(|execution| execution.task.clone()).collect()
        };
        lingering.into_iter().for_each(|task| task.run());
    }

    /// Polls each command that can make progress once, on virtual time.
    pub(crate) fn poll_ready(&self) {
        let ready = std::mem::take(&mut *lock(&self.0.ready));
        ready.into_iter().for_each(|task| task.run());
    }

    pub(crate) fn has_ready(&self) -> bool {
        !lock(&self.0.ready).is_empty()
    }
}

impl CommandControls for Control {
    fn commands(&self) -> Vec<CommandInfo> {
        let mut running = vec![0; self.0.declared.commands.len()];
        for execution in self.lock().executions.iter().filter(|execution| !execution.is_lingering()) {
            running[execution.command] += 1;
        }
        let mut infos = Vec::new();
        for ((declared, command), running) in self.0.declared.commands.iter().zip(&self.0.commands).zip(running) {
            let (arguments, output) = command.0.shapes();
            infos.push(CommandInfo {
                path: declared.path,
                role: command.0.role(),
                arguments,
                default_arguments: command.0.default_arguments(),
                output,
                allowed_states: declared.allowed_states,
                category: self.category(declared).name,
                timeout: declared.timeout_nanos.map(|nanos| Duration::from_nanos(nanos.max(0).unsigned_abs())),
                running,
            });
        }
        infos
    }

    fn executions(&self) -> Vec<ExecutionInfo> {
        let state = self.lock();
        let (mut infos, mut messages) = (Vec::new(), Vec::new());
        for execution in state.executions.iter().filter(|execution| !execution.is_lingering()) {
            let Some(declared) = self.0.declared.commands.get(execution.command) else { continue };
            infos.push(ExecutionInfo {
                number: execution.id,
                path: declared.path,
                caller: execution.asked_by.clone(),
                started: execution.started,
                progress: None,
            });
            messages.push(execution.progress.clone());
        }
        drop(state);
        // The payload's code runs without the lock.
        for (info, message) in infos.iter_mut().zip(messages) {
            info.progress = message.and_then(|message| member_of(&message.to_json(), "payload"));
        }
        infos
    }

    fn keep_progress(&self, number: u64, progress: DynamicMessage) {
        let mut state = self.lock();
        let execution = state.executions.iter_mut().find(|execution| execution.id == number);
        let previous = execution.and_then(|execution| execution.progress.replace(progress));
        drop(state);
        crate::fault::discard(previous);
    }

    fn cancel(&self, number: u64, caller: &Caller) -> Result<(), Fault> {
        caller.check_valid()?;
        if !self.executions().iter().any(|execution| execution.number == number) {
            return Err(Fault::new(format!("no execution with the number {number} runs")));
        }
        let _permit = caller.permit()?;
        self.cancel_execution(number);
        Ok(())
    }

    fn start_command(&self, path: &str, json: &str, caller: &Caller) -> Result<DynamicExecution, Fault> {
        let number = self.0.declared.commands.iter().position(|declared| declared.path == path);
        let Some((number, command)) = number.and_then(|number| Some((number, self.0.commands.get(number)?))) else {
            let paths = self.0.declared.commands.iter().map(|declared| declared.path);
            let hint = did_you_mean(nearest_path(path, paths));
            return Err(Fault::new(format!("no command is at `{path}`{hint}")));
        };
        if command.0.role() == Role::Arming {
            caller.check(Right::Arm)?;
        }
        let arguments = command.0.arguments(json)?;
        let step = self.step();
        let _permit = match caller.permit() {
            Ok(permit) => permit,
            Err(fault) => {
                // It was cancelled while the arguments were created.
                drop(step);
                crate::fault::discard(arguments);
                return Err(fault);
            }
        };
        let slot = self.request(step, number, Some(arguments), caller.name().to_owned())?;
        Ok(DynamicExecution::new(UntypedExecution(slot)))
    }

    fn transition(&self, id: u64, name: &str, caller: &Caller) -> Result<(), Fault> {
        let mut step = self.step();
        let permitted = step.may_become(name).and_then(|state| Ok((state, caller.permit()?)));
        if let Ok((state, _)) = permitted {
            step.line(Event::Transition { execution: id, state: state.to_owned() });
            step.become_by(id, state);
        }
        step.finish();
        permitted.map(drop)
    }
}

impl Step<'_> {
    pub(super) fn declared(&self, command: usize) -> Option<&'static CommandDeclaration> {
        self.control.0.declared.commands.get(command)
    }

    pub(super) fn role(&self, command: usize) -> Role {
        self.control.0.commands.get(command).map_or(Role::Plain, |command| command.0.role())
    }

    /// The position of an execution. Disarming asks for each that it cancels, so it must not be looked for from the beginning.
    pub(super) fn position(&self, id: u64) -> Option<usize> {
        self.state.executions.binary_search_by_key(&id, |execution| execution.id).ok()
    }

    /// The position of an execution that has not ended.
    pub(super) fn running(&self, id: u64) -> Option<usize> {
        self.position(id).filter(|index| !self.state.executions[*index].is_lingering())
    }

    /// The name of an execution's command.
    pub(super) fn name_of(&self, id: u64) -> Option<&'static str> {
        let execution = self.state.executions.get(self.position(id)?)?;
        self.declared(execution.command).map(|declared| declared.name)
    }

    /// The numbers of executions that have not ended and match.
    pub(super) fn not_ended(&self, fits: &dyn Fn(&RunningCommand) -> bool) -> Vec<u64> {
        let fits = |execution: &&RunningCommand| !execution.is_lingering() && fits(execution);
        self.state.executions.iter().filter(fits).map(|execution| execution.id).collect()
    }

    /// Starts a command, or returns why it cannot be started.
    pub(super) fn start(
        &mut self,
        number: usize,
        arguments: Option<Arguments>,
        asked_by: String,
        health: Option<HealthTransition>,
    ) -> Result<Arc<Slot>, Refusal> {
        let Some(declared) = self.declared(number) else {
            // Numbers and declarations come from one expansion.
            let category = CategoryDeclaration { name: "", concurrency: 0 };
            return Err(Refusal { command: "", reason: RefusalReason::Stopping, state: "", category });
        };
        let role = self.role(number);
        if let Err(reason) = self.may_start(declared, role).and_then(|()| self.has_room(role, health.is_some())) {
            let category = self.control.category(declared);
            let refusal = Refusal { command: declared.name, reason, state: self.state.machine.state(), category };
            self.effects.dropped.extend(arguments);
            self.refuse(number, refusal.clone(), asked_by, health);
            return Err(refusal);
        }
        let cancelled = self.not_ended(&|execution| {
            self.declared(execution.command).is_some_and(|other| declared.cancel.includes(other.category))
        });
        for id in cancelled {
            self.cancel_one(id);
        }
        let id = self.state.next_id;
        self.state.next_id += 1;
        self.state.machine.running += 1;
        if let Some(statistics) = self.state.statistics.get_mut(number) {
            statistics.started += 1;
            statistics.refused_at = None;
        }
        let control = self.control.clone();
        let slot = Arc::new(Slot::new(id, number, control.downgrade()));
        let caller = Caller::execution(declared.path);
        let is_for_safety = role == Role::Disarming || health.is_some();
        let lane = if is_for_safety { Lane::Safety } else { Lane::Commands };
        let task = (control.0.mode != Mode::Replay).then(|| {
            let (caller, weak) = (caller.clone(), control.downgrade());
            let starter = move || {
                let gone = || Fault::new("the robot is gone");
                let control = weak.upgrade().ok_or_else(gone)?;
                let prepared = control.0.commands.get(number).ok_or_else(gone)?;
                let context = CommandContext {
                    name: declared.name,
                    health,
                    path: declared.path,
                    execution: id,
                    bus: Bus::new(control.host()?, caller),
                    sleeper: control.0.sleeper.in_lane(lane),
                };
                prepared.0.start(arguments, &control.parameters(), context)
            };
            Arc::new(Task::new(id, lane, control.downgrade(), Box::new(starter)))
        });
        self.effects.begun.extend(task.clone());
        if let Some(timeout) = declared.timeout_nanos
            && self.control.0.mode != Mode::Replay
        {
            self.control.0.limits.set(Limit::Execution(id), self.now.plus_nanos(timeout));
        }
        let execution = RunningCommand {
            id,
            command: number,
            asked_by: asked_by.clone(),
            health,
            slot: Arc::clone(&slot),
            caller,
            started: self.now,
            progress: None,
            task,
            phase: Phase::Running,
        };
        // At the end, unless a damaged journal is replayed.
        let index = self.state.executions.partition_point(|other| other.id < id);
        self.state.executions.insert(index, execution);
        self.publish_phase(number, id, CommandPhase::Started, asked_by, health);
        self.publish_machine(Some(declared.name));
        Ok(slot)
    }

    fn may_start(&self, declared: &CommandDeclaration, role: Role) -> Result<(), RefusalReason> {
        if self.state.is_stopping {
            return Err(RefusalReason::Stopping);
        }
        if matches!(self.state.machine.safety, Safety::Error | Safety::Disarming) {
            return Err(RefusalReason::Safety);
        }
        if !declared.allowed(role, self.state.machine.state()) {
            return Err(RefusalReason::State);
        }
        let running = self.not_ended(&|execution| {
            self.declared(execution.command).is_some_and(|other| other.category == declared.category)
        });
        let concurrency = self.control.category(declared).concurrency;
        if running.len() >= concurrency && !declared.cancel.includes(declared.category) {
            return Err(RefusalReason::Busy);
        }
        Ok(())
    }

    /// Counts a refusal and publishes it.
    fn refuse(&mut self, number: usize, refusal: Refusal, asked_by: String, health: Option<HealthTransition>) {
        if let Some(statistics) = self.state.statistics.get_mut(number) {
            statistics.refused += 1;
            statistics.last_refusal = Some(refusal.clone());
            statistics.refused_at = Some(self.now);
        }
        self.effects.log(Log::Refused(refusal.clone()));
        self.publish_phase(number, 0, CommandPhase::Refused(refusal), asked_by, health);
    }

    pub(super) fn publish_phase(
        &mut self,
        number: usize,
        execution: u64,
        phase: CommandPhase,
        caller: String,
        health: Option<HealthTransition>,
    ) {
        let control = self.control;
        if let (Some(topic), Some(declared)) = (control.0.topics.commands.get(number), self.declared(number)) {
            let event = CommandEvent { command: declared.name, execution, phase, caller, health };
            self.publish(topic, event, self.now);
        }
    }

    /// Returns whether another command may start. A command that hangs leaves an execution running each time it is started and cancelled.
    fn has_room(&self, role: Role, of_health: bool) -> Result<(), RefusalReason> {
        let executions = self.state.executions.iter();
        let lingering = executions.filter(|execution| execution.is_lingering()).count();
        let most = if of_health { 2 * MOST_LINGERING } else { MOST_LINGERING };
        if role == Role::Disarming || lingering < most { Ok(()) } else { Err(RefusalReason::Hanging) }
    }
}
