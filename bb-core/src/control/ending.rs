//! How a command ends: by itself, cancelled, or timed out.

use super::arming::ARM_WITHIN;
use super::execution::CommandError;
use super::machine::IDLE;
use super::step::Step;
use super::task::{Ended, EndedCode, Value};
use super::{Control, Limit, Phase, RunningCommand};
use crate::component::Outcome;
use crate::declaration::Role;
use crate::event::{CommandPhase, Safety};
use crate::journal::{End, Event};
use crate::node::Mode;
use std::sync::Arc;
use std::time::Duration;

/// How often to check whether the handles of a command still act.
const LOOK_AGAIN: Duration = Duration::from_millis(1);

impl Control {
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

    pub(super) fn process_end(&self, id: u64, end: End, value: Option<Value>) {
        let mut step = self.step();
        // Callbacks that make safe what was started late must not run on an armed robot. A replay knows nothing of them, so the
        // entry is written afterwards.
        if step.state.is_making_safe() && step.is_arming(id) {
            step.state.held.push(EndedCode { id, end, value });
            return step.finish();
        }
        let Some(index) = step.running(id) else {
            // It was cancelled meanwhile, or has timed out.
            step.effects.dropped.extend(value);
            step.returned(id);
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
        step.returned(id);
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
}

impl Step<'_> {
    /// Cancels every command but one.
    pub(super) fn cancel_all(&mut self, but: Option<u64>) {
        for id in self.not_ended(|_, execution| Some(execution.id) != but) {
            self.cancel_one(id);
        }
    }

    /// Cancels a command that would arm the robot.
    pub(super) fn cancel_arming(&mut self) {
        for id in self.not_ended(|step, execution| step.role(execution.command) == Role::Arming) {
            self.cancel_one(id);
        }
    }

    pub(super) fn cancel_one(&mut self, id: u64) {
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

    /// Whether that execution is of a command that arms the robot.
    fn is_arming(&self, id: u64) -> bool {
        let execution = self.state.executions.iter().find(|execution| execution.id == id);
        execution.is_some_and(|execution| self.role(execution.command) == Role::Arming)
    }

    fn set_phase(&mut self, index: usize, phase: Phase) {
        if let Some(execution) = self.state.executions.get_mut(index) {
            // Its code has ended: none of its handles may act any more.
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

    /// Ends the execution at `index`. The caller publishes the change of the operational state.
    pub(super) fn end(
        &mut self,
        index: usize,
        result: Result<Option<Value>, CommandError>,
        next_state: Option<&'static str>,
    ) {
        let is_armed = self.state.machine.safety == Safety::Armed;
        let Some(execution) = self.state.executions.get_mut(index) else { return };
        let (id, command, health) = (execution.id, execution.command, execution.health);
        execution.permit.revoke();
        let slot = Arc::clone(&execution.slot);
        // An execution whose code has ended is gone; another one's code has yet to notice.
        let previous = std::mem::replace(&mut execution.phase, Phase::Lingering);
        let goes_on = matches!(previous, Phase::Running)
            && matches!(result, Err(CommandError::Cancelled | CommandError::TimedOut));
        match previous {
            Phase::Running if goes_on => {
                if let Some(task) = &execution.task {
                    task.mark_cancelled();
                    execution.lingers_on |= task.may_act() && !is_armed;
                }
                self.effects.cancelled.extend(execution.task.clone());
            }
            Phase::Disarming(value, _) | Phase::Arming(value, _) => {
                self.effects.dropped.extend(value);
                self.state.executions.remove(index);
            }
            Phase::Running | Phase::Lingering => drop(self.state.executions.remove(index)),
        }
        if !goes_on {
            self.effects.forgotten.extend(self.state.hooks.take_of_execution(id));
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
            // A replay has no value, and no caller waits for one.
            Ok(None) => {}
            Err(error) => self.effects.results.push((slot, Err(error))),
        }
    }

    /// The code of a cancelled execution has returned. Hardware it may have started since is made safe before it is
    /// gone.
    fn returned(&mut self, id: u64) {
        let acts = |execution: &RunningCommand| execution.id == id && execution.permit.is_acting();
        if self.control.0.mode == Mode::Real && self.state.executions.iter().any(acts) {
            // A thread it has left running is about to publish, and must not do so once the robot is armed again.
            return self.control.0.limits.set(Limit::Gone(id), self.now + LOOK_AGAIN);
        }
        if !self.makes_safe_after(id) {
            self.gone(id);
        }
    }

    /// A cancelled execution is gone.
    pub(super) fn gone(&mut self, id: u64) {
        let lingering =
            |execution: &RunningCommand| execution.id == id && matches!(execution.phase, Phase::Lingering);
        let Some(index) = self.state.executions.iter().position(lingering) else { return };
        let arming = |execution: &RunningCommand| matches!(execution.phase, Phase::Arming(..));
        if self.state.is_making_safe() && self.state.executions.iter().any(arming) {
            // As in `process_end`: what waits for it would arm the robot.
            return self.state.held_gone.push(id);
        }
        self.line(Event::Gone { execution: id });
        self.state.executions.remove(index);
        self.effects.forgotten.extend(self.state.hooks.take_of_execution(id));
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
