//! Commands: which may start, how they go on, how they end.

use super::arming::ARM_WITHIN;
use super::command::Arguments;
use super::effects::Log;
use super::execution::{CommandError, Execution, Slot, UntypedExecution};
use super::machine::IDLE;
use super::step::Step;
use super::system::{Control, Limit, Phase, RunningCommand};
use super::task::{Ended, Task, Value};
use crate::component::{CommandContext, CommandInfo, DynamicExecution, Outcome, OwnHooks, Permit};
use crate::declaration::{CommandDeclaration, Role};
use crate::event::{
    CategoryDeclaration, CommandEvent, CommandPhase, HealthTransition, Refusal, RefusalReason, Safety,
};
use crate::fault::Fault;
use crate::journal::{End, Event};
use crate::node::Mode;
use std::sync::Arc;
use std::time::Duration;

impl Control {
    /// That all commands could start with their options as they are; else the path of one, and why not.
    pub(crate) fn check_commands(&self) -> Result<(), (&'static str, String)> {
        let parameters = self.parameters();
        self.0.commands.iter().zip(self.0.declared.commands).try_for_each(|(command, declared)| {
            command.0.check(&parameters).map_err(|message| (declared.path, message))
        })
    }

    /// Starts a command for a caller who knows the type of its result.
    pub(crate) fn execute<T: 'static>(&self, number: usize, arguments: Arguments) -> Result<Execution<T>, Refusal> {
        self.request(self.step(), number, Some(arguments)).map(Execution::new)
    }

    /// Starts the command at `path` with arguments from JSON, for one whose permit that is.
    pub(crate) fn execute_untyped(
        &self,
        path: &str,
        json: &str,
        permit: &Permit,
    ) -> Result<DynamicExecution, Fault> {
        let number = self.0.declared.commands.iter().position(|declared| declared.path == path);
        let Some((number, command)) = number.and_then(|number| Some((number, self.0.commands.get(number)?))) else {
            let paths = self.0.declared.commands.iter().map(|declared| declared.path);
            let near = crate::message::nearest::nearest_path(path, paths);
            let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            return Err(Fault::new(format!("no command is at `{path}`{hint}")));
        };
        let arguments = command.0.arguments(json)?;
        let step = self.step();
        if let Err(fault) = permit.check() {
            // It was cancelled while the arguments were made.
            drop(step);
            crate::fault::discard(arguments);
            return Err(fault);
        }
        let slot = self.request(step, number, Some(arguments))?;
        Ok(DynamicExecution::new(UntypedExecution(slot)))
    }

    /// In a replay: a command was asked for.
    pub(crate) fn replay_command(&self, number: usize) {
        // One that was refused is refused again.
        let _ = self.request(self.step(), number, None);
    }

    fn request(
        &self,
        mut step: Step<'_>,
        number: usize,
        arguments: Option<Arguments>,
    ) -> Result<Arc<Slot>, Refusal> {
        step.line(Event::Command { command: number });
        let started = step.start(number, arguments, None);
        step.finish();
        started
    }

    pub(crate) fn infos(&self) -> Vec<CommandInfo> {
        let declared = self.0.declared.commands.iter();
        let infos = declared.zip(&self.0.commands).map(|(declared, command)| {
            let (arguments, output) = command.0.shapes();
            CommandInfo {
                path: declared.path,
                arguments,
                output,
                allowed_states: declared.allowed_states,
                category: self.category(declared).name,
                timeout: declared.timeout_nanos.map(|nanos| Duration::from_nanos(nanos.max(0).unsigned_abs())),
            }
        });
        infos.collect()
    }

    pub(super) fn result_json(&self, command: usize, result: Value) -> Result<String, Fault> {
        match self.0.commands.get(command) {
            Some(command) => command.0.result_json(result),
            None => Err(Fault::new("there is no such command")),
        }
    }

    fn category(&self, declared: &CommandDeclaration) -> CategoryDeclaration {
        let category = self.0.declared.categories.get(declared.category).copied();
        category.unwrap_or(CategoryDeclaration { name: "default", concurrency: 1 })
    }

    /// Cancels an execution for its caller.
    pub(crate) fn cancel(&self, id: u64) {
        self.end_early(id, Event::Cancel { execution: id }, CommandError::Cancelled);
    }

    /// An execution has taken longer than its `timeout`.
    pub(crate) fn timed_out(&self, id: u64) {
        self.end_early(id, Event::Timeout { execution: id }, CommandError::TimedOut);
    }

    fn end_early(&self, id: u64, event: Event, error: CommandError) {
        let mut step = self.step();
        if let Some(index) = step.running(id) {
            step.line(event);
            let name = step.name_of(id);
            step.end(index, Err(error), None);
            step.publish_machine(name);
            step.finish();
        }
    }

    /// The code of a command has ended.
    pub(super) fn ended(&self, id: u64, ended: Ended) {
        let (end, value) = match ended {
            Ok(Outcome { value, next_state }) => {
                (End::Succeeded { next_state: next_state.map(str::to_owned) }, Some(value))
            }
            Err(fault) => (End::Failed { message: fault.to_string() }, None),
        };
        self.process_end(id, end, value);
    }

    /// In a replay: the code of a command had ended.
    pub(crate) fn replay_end(&self, id: u64, end: End) {
        self.process_end(id, end, None);
    }

    fn process_end(&self, id: u64, end: End, value: Option<Value>) {
        let mut step = self.step();
        let Some(index) = step.running(id) else {
            // It was cancelled meanwhile, or has timed out.
            step.effects.dropped.extend(value);
            step.gone(id);
            return step.finish();
        };
        step.line(Event::Ended { execution: id, end: end.clone() });
        let name = step.name_of(id);
        step.process_end(index, end, value);
        step.publish_machine(name);
        step.finish();
    }

    /// The future of a command that was cancelled has been dropped.
    pub(crate) fn gone(&self, id: u64) {
        let mut step = self.step();
        step.gone(id);
        step.finish();
    }

    /// An arming command has waited for too long for cancelled ones.
    pub(crate) fn arm_timeout(&self) {
        let mut step = self.step();
        let waiting = |execution: &RunningCommand| matches!(execution.phase, Phase::Arming(..));
        if !step.state.executions.iter().any(waiting) {
            return;
        }
        step.line(Event::ArmTimeout);
        while let Some(index) = step.state.executions.iter().position(waiting) {
            let message = "commands that were cancelled have not returned".to_owned();
            step.end(index, Err(CommandError::Failed(message)), None);
        }
        step.finish();
    }

    /// On virtual time: drops the futures of cancelled commands now.
    pub(super) fn drop_cancelled(&self) {
        let lingering: Vec<_> = {
            let state = self.lock();
            let lingering = state.executions.iter().filter(|execution| matches!(execution.phase, Phase::Lingering));
            lingering.filter_map(|execution| execution.task.clone()).collect()
        };
        lingering.into_iter().for_each(|task| task.run());
    }

    /// On virtual time: polls each command once that can go on.
    pub(crate) fn poll_ready(&self) {
        let ready = std::mem::take(&mut *self.0.ready.lock().unwrap_or_else(std::sync::PoisonError::into_inner));
        ready.into_iter().for_each(|task| task.run());
    }

    pub(crate) fn has_ready(&self) -> bool {
        !self.0.ready.lock().unwrap_or_else(std::sync::PoisonError::into_inner).is_empty()
    }
}

impl Step<'_> {
    pub(super) fn declared(&self, command: usize) -> Option<&'static CommandDeclaration> {
        self.control.0.declared.commands.get(command)
    }

    pub(super) fn role(&self, command: usize) -> Role {
        self.control.0.commands.get(command).map_or(Role::Plain, |command| command.0.role())
    }

    /// The position of an execution that has not ended.
    fn running(&self, id: u64) -> Option<usize> {
        let mut executions = self.state.executions.iter();
        executions.position(|execution| execution.id == id && !matches!(execution.phase, Phase::Lingering))
    }

    /// The name of an execution's command.
    pub(super) fn name_of(&self, id: u64) -> Option<&'static str> {
        let execution = self.state.executions.iter().find(|execution| execution.id == id)?;
        self.declared(execution.command).map(|declared| declared.name)
    }

    /// Starts a command, or says why not.
    pub(super) fn start(
        &mut self,
        number: usize,
        arguments: Option<Arguments>,
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
            self.refuse(number, refusal.clone(), health);
            return Err(refusal);
        }
        let cancelled: Vec<u64> = self.not_ended(|step, execution| {
            step.declared(execution.command).is_some_and(|other| declared.cancel.includes(other.category))
        });
        for id in cancelled {
            self.cancel_one(id);
        }
        let id = self.state.next_id;
        self.state.next_id += 1;
        self.state.machine.running += 1;
        if let Some(statistics) = self.state.statistics.get_mut(number) {
            statistics.started += 1;
        }
        let control = self.control.clone();
        let slot = Arc::new(Slot::new(id, number, control.downgrade()));
        let permit = Permit::revocable();
        let lane = self.lane(number, health.is_some());
        let task = (control.0.mode != Mode::Replay).then(|| {
            let (permit, weak) = (permit.clone(), control.downgrade());
            let starter = move || {
                let gone = || Fault::new("the robot is gone");
                let control = weak.upgrade().ok_or_else(gone)?;
                let prepared = control.0.commands.get(number).ok_or_else(gone)?;
                let host = control.host()?;
                let context = CommandContext {
                    name: declared.name,
                    health,
                    hooks: Arc::new(OwnHooks::new(declared.path, Arc::clone(&host) as _, id)),
                    host,
                    sleeper: control.0.sleeper.in_lane(lane),
                    permit,
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
        let phase = Phase::Running;
        let execution =
            RunningCommand { id, command: number, health, slot: Arc::clone(&slot), permit, task, phase };
        self.state.executions.push(execution);
        self.publish_phase(number, id, CommandPhase::Started, health);
        self.publish_machine(Some(declared.name));
        Ok(slot)
    }

    /// The numbers of executions that have not ended and fit.
    fn not_ended(&self, fits: impl Fn(&Self, &RunningCommand) -> bool) -> Vec<u64> {
        let executions = self.state.executions.iter();
        let executions = executions.filter(|execution| !matches!(execution.phase, Phase::Lingering));
        executions.filter(|execution| fits(self, execution)).map(|execution| execution.id).collect()
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
        let running = self.not_ended(|step, execution| {
            step.declared(execution.command).is_some_and(|other| other.category == declared.category)
        });
        let concurrency = self.control.category(declared).concurrency;
        if running.len() >= concurrency && !declared.cancel.includes(declared.category) {
            return Err(RefusalReason::Busy);
        }
        Ok(())
    }

    /// Counts a refusal and publishes it.
    fn refuse(&mut self, number: usize, refusal: Refusal, health: Option<HealthTransition>) {
        if let Some(statistics) = self.state.statistics.get_mut(number) {
            statistics.refused += 1;
            statistics.last_refusal = Some(refusal.clone());
        }
        self.effects.log(Log::Refused(refusal.clone()));
        self.publish_phase(number, 0, CommandPhase::Refused(refusal), health);
    }

    fn publish_phase(
        &mut self,
        number: usize,
        execution: u64,
        phase: CommandPhase,
        health: Option<HealthTransition>,
    ) {
        let control = self.control;
        if let (Some(topic), Some(declared)) = (control.0.topics.commands.get(number), self.declared(number)) {
            let event = CommandEvent { command: declared.name, execution, phase, health };
            self.publish(topic, event, self.now);
        }
    }

    /// Cancels every command but one.
    pub(super) fn cancel_all(&mut self, but: Option<u64>) {
        for id in self.not_ended(|_, execution| Some(execution.id) != but) {
            self.cancel_one(id);
        }
    }

    /// Cancels what would arm the robot.
    pub(super) fn cancel_arming(&mut self) {
        for id in self.not_ended(|step, execution| step.role(execution.command) == Role::Arming) {
            self.cancel_one(id);
        }
    }

    fn cancel_one(&mut self, id: u64) {
        if let Some(index) = self.running(id) {
            self.end(index, Err(CommandError::Cancelled), None);
        }
    }

    /// The code of the execution at `index` has ended.
    fn process_end(&mut self, index: usize, end: End, value: Option<Value>) {
        let Some(execution) = self.state.executions.get(index) else { return };
        let (id, command) = (execution.id, execution.command);
        let next_state = match end {
            End::Succeeded { next_state } => next_state,
            End::Failed { message } => {
                self.effects.dropped.extend(value);
                return self.end(index, Err(CommandError::Failed(message)), None);
            }
        };
        let next_state = match next_state.map(|name| self.state_named(&name).ok_or(name)).transpose() {
            Ok(next_state) => next_state,
            Err(name) => {
                self.effects.dropped.extend(value);
                let message = format!("it names the next state `{name}`, which is not declared");
                return self.end(index, Err(CommandError::Failed(message)), None);
            }
        };
        let name = self.declared(command).map(|declared| declared.name);
        match self.role(command) {
            Role::Disarming if self.state.machine.safety == Safety::Armed => {
                self.set_phase(index, Phase::Disarming(value, next_state));
                self.begin_disarming(Some(id), name, false);
            }
            Role::Arming if self.state.machine.safety == Safety::Disarmed && self.state.has_lingering() => {
                self.set_phase(index, Phase::Arming(value, next_state));
                if self.control.0.mode != Mode::Replay {
                    self.control.0.limits.set(Limit::Arming, self.now + ARM_WITHIN);
                }
            }
            Role::Arming => self.arm_by(index, value, next_state),
            Role::Plain | Role::Disarming => self.end(index, Ok(value), next_state),
        }
    }

    fn set_phase(&mut self, index: usize, phase: Phase) {
        if let Some(execution) = self.state.executions.get_mut(index) {
            // Its code has ended: nothing it holds may act any more.
            execution.permit.revoke();
            execution.phase = phase;
        }
    }

    /// The execution at `index` arms the robot.
    fn arm_by(&mut self, index: usize, value: Option<Value>, next_state: Option<&'static str>) {
        if self.state.machine.safety == Safety::Disarmed && !self.state.is_stopping {
            self.state.machine.safety = Safety::Armed;
            self.state.machine.resting = IDLE;
        }
        if self.state.machine.safety == Safety::Armed {
            return self.end(index, Ok(value), next_state);
        }
        self.effects.dropped.extend(value);
        let why = if self.state.is_stopping { "the robot stops".to_owned() } else { self.safety_text() };
        self.end(index, Err(CommandError::Failed(format!("the robot was not armed: {why}"))), None);
    }

    fn safety_text(&self) -> String {
        format!("its safety state is `{}`", self.state.machine.safety)
    }

    /// The robot was disarmed by that execution.
    pub(super) fn finish_disarming_command(&mut self, id: u64) {
        let Some(index) = self.running(id) else { return };
        let is_error = self.state.machine.safety == Safety::Error;
        let Some(execution) = self.state.executions.get_mut(index) else { return };
        match std::mem::replace(&mut execution.phase, Phase::Running) {
            Phase::Disarming(value, _) if is_error => {
                self.effects.dropped.extend(value);
                let message = format!("not everything could be made safe: {}", self.safety_text());
                self.end(index, Err(CommandError::Failed(message)), None);
            }
            Phase::Disarming(value, next_state) => self.end(index, Ok(value), next_state),
            phase => execution.phase = phase,
        }
    }

    /// A built-in or declared state.
    fn state_named(&self, name: &str) -> Option<&'static str> {
        if name == IDLE {
            return Some(IDLE);
        }
        self.control.0.declared.states.iter().copied().find(|state| *state == name)
    }

    /// The execution at `index` ends. What that does to the operational state is published by the caller.
    pub(super) fn end(
        &mut self,
        index: usize,
        result: Result<Option<Value>, CommandError>,
        next_state: Option<&'static str>,
    ) {
        let Some(execution) = self.state.executions.get_mut(index) else { return };
        let (id, command, health) = (execution.id, execution.command, execution.health);
        execution.permit.revoke();
        let slot = Arc::clone(&execution.slot);
        let forgotten = self.state.hooks.take_of_execution(id);
        self.effects.forgotten.extend(forgotten);
        let Some(execution) = self.state.executions.get_mut(index) else { return };
        // One whose code has ended is gone; another one's code has yet to notice.
        let previous = std::mem::replace(&mut execution.phase, Phase::Lingering);
        match previous {
            Phase::Running if result.is_err() && !matches!(result, Err(CommandError::Failed(_))) => {
                self.effects.cancelled.extend(execution.task.clone());
            }
            Phase::Disarming(value, _) | Phase::Arming(value, _) => {
                self.effects.dropped.extend(value);
                self.state.executions.remove(index);
            }
            Phase::Running | Phase::Lingering => drop(self.state.executions.remove(index)),
        }
        self.control.0.limits.clear(Limit::Execution(id));
        self.state.machine.running = self.state.machine.running.saturating_sub(1);
        if let (Ok(_), Some(next_state)) = (&result, next_state) {
            self.state.machine.resting = next_state;
        }
        let phase = match &result {
            Ok(_) => CommandPhase::Succeeded,
            Err(CommandError::Failed(message)) => CommandPhase::Failed(message.clone()),
            Err(CommandError::TimedOut) => CommandPhase::TimedOut,
            Err(CommandError::Cancelled) => CommandPhase::Cancelled,
        };
        if let Some(statistics) = self.state.statistics.get_mut(command) {
            match &phase {
                CommandPhase::Succeeded => statistics.succeeded += 1,
                CommandPhase::Failed(_) => statistics.failed += 1,
                CommandPhase::TimedOut => statistics.timed_out += 1,
                CommandPhase::Cancelled => statistics.cancelled += 1,
                CommandPhase::Started | CommandPhase::Refused(_) => {}
            }
        }
        self.publish_phase(command, id, phase, health);
        match result {
            Ok(Some(value)) => self.effects.results.push((slot, Ok(value))),
            // In a replay there is no value, and nobody waits for it.
            Ok(None) => {}
            Err(error) => self.effects.results.push((slot, Err(error))),
        }
    }

    /// The code of a cancelled execution has returned.
    fn gone(&mut self, id: u64) {
        let lingering =
            |execution: &RunningCommand| execution.id == id && matches!(execution.phase, Phase::Lingering);
        let Some(index) = self.state.executions.iter().position(lingering) else { return };
        self.line(Event::Gone { execution: id });
        self.state.executions.remove(index);
        if self.state.has_lingering() {
            return;
        }
        self.control.0.limits.clear(Limit::Arming);
        let waiting = |execution: &RunningCommand| matches!(execution.phase, Phase::Arming(..));
        while let Some(index) = self.state.executions.iter().position(waiting) {
            let Some(execution) = self.state.executions.get_mut(index) else { return };
            if let Phase::Arming(value, next_state) = std::mem::replace(&mut execution.phase, Phase::Running) {
                // Its code has ended: it leaves the list at once.
                self.set_phase(index, Phase::Arming(None, None));
                let name = self.state.executions.get(index).and_then(|execution| self.declared(execution.command));
                self.arm_by(index, value, next_state);
                self.publish_machine(name.map(|declared| declared.name));
            }
        }
    }
}
