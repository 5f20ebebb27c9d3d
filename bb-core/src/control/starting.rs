//! Starting commands, and the reasons for refusing them.

use super::command::Arguments;
use super::effects::Log;
use super::execution::Slot;
use super::step::Step;
use super::task::Task;
use super::{Limit, Phase, RunningCommand};
use crate::component::{CommandContext, OwnHooks, Permit};
use crate::declaration::{CommandDeclaration, Role};
use crate::event::{
    CategoryDeclaration, CommandEvent, CommandPhase, HealthTransition, Refusal, RefusalReason, Safety,
};
use crate::fault::Fault;
use crate::node::Mode;
use std::sync::Arc;

impl Step<'_> {
    /// Starts a command, or returns why it cannot be started.
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
        let execution = RunningCommand {
            id,
            command: number,
            health,
            slot: Arc::clone(&slot),
            permit,
            task,
            phase: Phase::Running,
            lingers_on: false,
        };
        self.state.executions.push(execution);
        self.publish_phase(number, id, CommandPhase::Started, health);
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

    pub(super) fn publish_phase(
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
}
