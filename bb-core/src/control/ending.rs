//! Ends of commands: by themselves, cancelled, or timed out.
//!
//! - Its code returns ([`Control::code_returned`]): the outcome is written to the journal and applied. A command that disarms waits for
//!   the disarming, one that arms waits for cancelled commands; any other is settled at once.
//! - It is cancelled or times out ([`Control::cut_short`]): it is settled at once, and its handles are dead. Its execution lingers until
//!   its code has returned and its future is dropped ([`Control::future_dropped`]). The robot is not armed before.
//! - [`Step::settle`] gives the caller the result, whichever way it came.

use super::arming::ARM_WITHIN;
use super::execution::{CommandError, Ended, EndedCode, Value};
use super::step::{IDLE, Step};
use super::{Control, Limit, Phase, RunningCommand};
use crate::component::Outcome;
use crate::declaration::Role;
use crate::event::{CommandPhase, Safety};
use crate::fault::Fault;
use crate::journal::{End, Event};
use crate::node::Mode;
use bb_message::__private::{did_you_mean, nearest};
use std::sync::Arc;

impl Control {
    /// Cancels an execution for its caller.
    pub(crate) fn cancel_execution(&self, id: u64) {
        self.cut_short(id, Event::Cancel { execution: id }, CommandError::Cancelled);
    }

    /// Replays a change of the operational state by an execution.
    pub(crate) fn replay_transition(&self, id: u64, name: &str) {
        let mut step = self.step();
        if let Ok(state) = step.may_become(name) {
            step.line(Event::Transition { execution: id, state: state.to_owned() });
            step.become_by(id, state);
        }
        step.finish();
    }

    /// An execution has taken longer than its `timeout`.
    pub(crate) fn timed_out(&self, id: u64) {
        self.cut_short(id, Event::Timeout { execution: id }, CommandError::TimedOut);
    }

    fn cut_short(&self, id: u64, event: Event, error: CommandError) {
        let mut step = self.step();
        if let Some(index) = step.running(id) {
            step.line(event);
            let name = step.name_of(id);
            step.settle(index, Err(error), None);
            step.publish_machine(name);
            step.finish();
        }
    }

    /// The code of a command has returned.
    pub(super) fn code_returned(&self, id: u64, ended: Ended) {
        let (end, value) = match ended {
            Ok(Outcome { value, next_state }) => {
                (End::Succeeded { next_state: next_state.map(str::to_owned) }, Some(value))
            }
            Err(fault) => (End::Failed { message: fault.to_string() }, None),
        };
        self.apply_outcome(id, end, value);
    }

    /// Replays the end of a command's code.
    pub(crate) fn replay_end(&self, id: u64, end: End) {
        self.apply_outcome(id, end, None);
    }

    pub(super) fn apply_outcome(&self, id: u64, end: End, value: Option<Value>) {
        let mut step = self.step();
        // What is being made safe must be so before the robot is armed. A replay knows nothing of it, so the entry is written
        // afterwards.
        if !step.state.apart.is_empty() && step.is_arming(id) {
            step.state.held.push(EndedCode { id, end, value });
            return step.finish();
        }
        let Some(index) = step.running(id) else {
            // It was cancelled meanwhile, or has timed out.
            step.effects.dropped.extend(value);
            step.forget_lingering(id);
            return step.finish();
        };
        step.line(Event::Ended { execution: id, end: end.clone() });
        let name = step.name_of(id);
        step.apply_outcome(index, end, value);
        step.publish_machine(name);
        step.finish();
    }

    /// The future of a command that was cancelled has been dropped.
    pub(crate) fn future_dropped(&self, id: u64) {
        let mut step = self.step();
        step.forget_lingering(id);
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
            step.settle(index, Err(CommandError::Failed(message)), None);
        }
        step.finish();
    }
}

impl RunningCommand {
    /// Returns whether it is settled, and its code has yet to return.
    pub(super) fn is_lingering(&self) -> bool {
        matches!(self.phase, Phase::Lingering)
    }

    /// Returns whether the command's code has not returned, or its future is to be dropped.
    pub(super) fn is_inside(&self) -> bool {
        self.task.as_ref().is_some_and(|task| task.may_act())
    }
}

impl Step<'_> {
    /// Cancels every command but one.
    pub(super) fn cancel_all(&mut self, but: Option<u64>) {
        for id in self.not_ended(&|execution| Some(execution.id) != but) {
            self.cancel_one(id);
        }
    }

    /// Cancels a command that would arm the robot.
    pub(super) fn cancel_arming(&mut self) {
        for id in self.not_ended(&|execution| self.role(execution.command) == Role::Arming) {
            self.cancel_one(id);
        }
    }

    pub(super) fn cancel_one(&mut self, id: u64) {
        if let Some(index) = self.running(id) {
            self.settle(index, Err(CommandError::Cancelled), None);
        }
    }

    /// Applies the outcome of the execution at `index`.
    fn apply_outcome(&mut self, index: usize, end: End, value: Option<Value>) {
        let Some(execution) = self.state.executions.get(index) else { return };
        let (id, command) = (execution.id, execution.command);
        let next_state = match end {
            End::Succeeded { next_state } => next_state,
            End::Failed { message } => {
                self.effects.dropped.extend(value);
                return self.settle(index, Err(CommandError::Failed(message)), None);
            }
        };
        let next_state = match next_state.map(|name| self.state_named(&name).ok_or(name)).transpose() {
            Ok(next_state) => next_state,
            Err(name) => {
                self.effects.dropped.extend(value);
                let message = format!("it names the next state `{name}`, which is not declared");
                return self.settle(index, Err(CommandError::Failed(message)), None);
            }
        };
        let name = self.declared(command).map(|declared| declared.name);
        match self.role(command) {
            Role::Disarming if self.state.machine.safety == Safety::Armed => {
                self.set_phase(index, Phase::Disarming(value, next_state));
                self.asked_by = self.state.executions.get(index).map(|execution| execution.asked_by.clone());
                self.begin_disarming(Some(id), name, false);
            }
            Role::Arming if self.state.machine.safety == Safety::Disarmed && self.state.has_lingering() => {
                self.set_phase(index, Phase::Arming(value, next_state));
                if self.control.0.mode != Mode::Replay {
                    self.control.0.limits.set(Limit::Arming, self.now + ARM_WITHIN);
                }
            }
            Role::Arming => self.arm_by(index, value, next_state),
            Role::Plain | Role::Disarming => self.settle(index, Ok(value), next_state),
        }
    }

    fn forget_hooks(&mut self, execution: u64) {
        let hooks = self.state.hooks.take_of_execution(execution);
        self.forget(hooks);
    }

    /// Returns whether that execution is of a command that arms the robot.
    fn is_arming(&self, id: u64) -> bool {
        let execution = self.position(id).and_then(|index| self.state.executions.get(index));
        execution.is_some_and(|execution| self.role(execution.command) == Role::Arming)
    }

    fn set_phase(&mut self, index: usize, phase: Phase) {
        if let Some(execution) = self.state.executions.get_mut(index) {
            // Its code has ended: none of its handles may act any more.
            execution.caller.revoke();
            execution.phase = phase;
        }
    }

    /// The execution at `index` arms the robot.
    fn arm_by(&mut self, index: usize, value: Option<Value>, next_state: Option<&'static str>) {
        if self.state.machine.safety == Safety::Disarmed && !self.state.is_stopping {
            self.state.machine.safety = Safety::Armed;
            self.state.machine.resting = IDLE;
            self.asked_by = self.state.executions.get(index).map(|execution| execution.asked_by.clone());
        }
        if self.state.machine.safety == Safety::Armed {
            return self.settle(index, Ok(value), next_state);
        }
        self.effects.dropped.extend(value);
        let why = if self.state.is_stopping { "the robot stops".to_owned() } else { self.safety_text() };
        self.settle(index, Err(CommandError::Failed(format!("the robot was not armed: {why}"))), None);
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
                self.settle(index, Err(CommandError::Failed(message)), None);
            }
            Phase::Disarming(value, next_state) => self.settle(index, Ok(value), next_state),
            phase => execution.phase = phase,
        }
    }

    /// The state of that name, if the operational state can be it now.
    pub(super) fn may_become(&self, name: &str) -> Result<&'static str, Fault> {
        let Some(state) = self.state_named(name) else {
            let states = self.control.0.declared.states.iter().copied().chain([IDLE]);
            let hint = did_you_mean(nearest(name, states));
            return Err(Fault::new(format!("no state `{name}` is declared{hint}")));
        };
        match self.state.machine.safety {
            Safety::Armed => Ok(state),
            _ => Err(Fault::new(format!("the robot is not armed: {}", self.safety_text()))),
        }
    }

    /// An execution changes the operational state.
    pub(super) fn become_by(&mut self, id: u64, state: &'static str) {
        self.state.machine.resting = state;
        let name = self.name_of(id);
        self.publish_machine(name);
    }

    /// A built-in or declared state.
    fn state_named(&self, name: &str) -> Option<&'static str> {
        if name == IDLE {
            return Some(IDLE);
        }
        self.control.0.declared.states.iter().copied().find(|state| *state == name)
    }

    /// Gives the caller of the execution at `index` its result. This function's caller publishes the change of the operational state.
    pub(super) fn settle(
        &mut self,
        index: usize,
        result: Result<Option<Value>, CommandError>,
        next_state: Option<&'static str>,
    ) {
        let Some(execution) = self.state.executions.get_mut(index) else { return };
        let (id, command, health) = (execution.id, execution.command, execution.health);
        let asked_by = std::mem::take(&mut execution.asked_by);
        execution.caller.revoke();
        let slot = Arc::clone(&execution.slot);
        // An execution whose code has ended is gone; another one's code has yet to notice.
        let previous = std::mem::replace(&mut execution.phase, Phase::Lingering);
        let goes_on = matches!(previous, Phase::Running)
            && matches!(result, Err(CommandError::Cancelled | CommandError::TimedOut));
        match previous {
            Phase::Running if goes_on => {
                if let Some(task) = &execution.task {
                    task.mark_cancelled();
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
            self.forget_hooks(id);
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
        self.publish_phase(command, id, phase, asked_by, health);
        match result {
            Ok(Some(value)) => self.effects.results.push((slot, Ok(value))),
            // A replay has no value, and no caller waits for one.
            Ok(None) => {}
            Err(error) => self.effects.results.push((slot, Err(error))),
        }
    }

    /// The code of a cancelled execution has returned, and its future is dropped. Commands that arm the robot may have waited for
    /// that.
    pub(super) fn forget_lingering(&mut self, id: u64) {
        let Some(index) = self.position(id) else { return };
        if !self.state.executions[index].is_lingering() {
            return;
        }
        let arming = |execution: &RunningCommand| matches!(execution.phase, Phase::Arming(..));
        if !self.state.apart.is_empty() && self.state.executions.iter().any(arming) {
            // As in `apply_outcome`: what waits for it would arm the robot.
            return self.state.held_lingering.push(id);
        }
        self.line(Event::Gone { execution: id });
        self.state.executions.remove(index);
        self.forget_hooks(id);
        if self.state.has_lingering() {
            return;
        }
        self.control.0.limits.clear(Limit::Arming);
        while let Some(index) = self.state.executions.iter().position(arming) {
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
