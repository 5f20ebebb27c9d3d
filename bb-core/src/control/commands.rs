//! Commands as callers see them: listing and starting them.

use super::command::Arguments;
use super::execution::{Execution, Slot, UntypedExecution};
use super::step::Step;
use super::task::Value;
use super::{Control, Phase, RunningCommand};
use crate::component::{CommandInfo, DynamicExecution, Permit};
use crate::declaration::{CommandDeclaration, Role};
use crate::event::{CategoryDeclaration, Refusal};
use crate::fault::Fault;
use crate::journal::Event;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

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
        self.request(self.step(), number, Some(arguments)).map(Execution::new)
    }

    /// Starts the command at `path` with arguments from JSON, on behalf of the holder of the permit.
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
            // It was cancelled while the arguments were created.
            drop(step);
            crate::fault::discard(arguments);
            return Err(fault);
        }
        let slot = self.request(step, number, Some(arguments))?;
        Ok(DynamicExecution::new(UntypedExecution(slot)))
    }

    /// In a replay: a command was requested.
    pub(crate) fn replay_command(&self, number: usize) {
        // A command that was refused is refused again.
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

    pub(super) fn category(&self, declared: &CommandDeclaration) -> CategoryDeclaration {
        let category = self.0.declared.categories.get(declared.category).copied();
        category.unwrap_or(CategoryDeclaration { name: "default", concurrency: 1 })
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

    /// On virtual time: polls each command that can make progress once.
    pub(crate) fn poll_ready(&self) {
        let ready = std::mem::take(&mut *self.0.ready.lock().unwrap_or_else(PoisonError::into_inner));
        ready.into_iter().for_each(|task| task.run());
    }

    pub(crate) fn has_ready(&self) -> bool {
        !self.0.ready.lock().unwrap_or_else(PoisonError::into_inner).is_empty()
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
    pub(super) fn running(&self, id: u64) -> Option<usize> {
        let mut executions = self.state.executions.iter();
        executions.position(|execution| execution.id == id && !matches!(execution.phase, Phase::Lingering))
    }

    /// The name of an execution's command.
    pub(super) fn name_of(&self, id: u64) -> Option<&'static str> {
        let execution = self.state.executions.iter().find(|execution| execution.id == id)?;
        self.declared(execution.command).map(|declared| declared.name)
    }

    /// The numbers of executions that have not ended and match.
    pub(super) fn not_ended(&self, fits: impl Fn(&Self, &RunningCommand) -> bool) -> Vec<u64> {
        let executions = self.state.executions.iter();
        let executions = executions.filter(|execution| !matches!(execution.phase, Phase::Lingering));
        executions.filter(|execution| fits(self, execution)).map(|execution| execution.id).collect()
    }
}
