//! Reports of estimators and other components: health, faults and panics; and the watchdog.
//!
//! An estimator is declared lost here, whether or not its island is free, and learns it by an entry. Both count the losses: a report
//! with an earlier count was made before the estimator knew, and is passed over. In a replay, a report waits until its line comes.

use super::effects::Log;
use super::faults::Verdict;
use super::step::Step;
use super::{ComponentOrder, Control};
use crate::declaration::{ParameterValues, Supervisor};
use crate::event::{HardwareError, HardwareErrorKind, HealthReason, HealthState, HealthTransition, SafetyError};
use crate::fault::{Failed, lock};
use crate::journal::Event;
use crate::node::{BindTarget, Check, HealthReport, Mode, NodeEntry, Overseer, Report};
use crate::time::MonotonicTime;
use std::collections::VecDeque;
use std::sync::Arc;

impl Overseer for Control {
    fn report(&self, estimator: usize, report: Report) {
        if self.0.mode == Mode::Replay {
            lock(&self.0.reports).get_or_insert(estimator, VecDeque::new).push_back(report);
            return;
        }
        self.process_report(estimator, report);
    }

    fn bind(&self, path: &'static str, parameters: &'static [usize], check: Check, target: BindTarget) {
        self.bind_to(path, parameters, Arc::new(check), target);
    }

    fn parameters(&self) -> ParameterValues {
        Control::parameters(self)
    }

    fn replacing_hooks(
        &self,
        path: &'static str,
        is_made: bool,
        make: &mut dyn FnMut() -> Result<(), Failed>,
    ) -> Result<(), Failed> {
        Control::replacing_hooks(self, path, is_made, make)
    }

    fn leave_out(&self, path: &'static str, reason: &str) {
        self.log(|| tracing::info!(component = path, reason, "left out"));
        let gone = self.lock().hooks.take_failed(path);
        gone.into_iter().for_each(crate::fault::discard);
    }
}

impl Control {
    /// Processes the first waiting report of an estimator in a replay; returns false if there is none.
    pub(crate) fn replay_report(&self, estimator: usize) -> bool {
        let report = lock(&self.0.reports).get_mut(&estimator).and_then(VecDeque::pop_front);
        match report {
            Some(report) => {
                self.process_report(estimator, report);
                true
            }
            None => false,
        }
    }

    fn process_report(&self, estimator: usize, report: Report) {
        let mut step = self.step();
        if step.state.has_ended {
            // From an island that was still busy: the last report is being made or has been made.
            return;
        }
        step.line(Event::Report { estimator });
        match report {
            Report::Health(report) => step.health_changed(estimator, report),
            Report::Failed { message, panicked } => {
                if let Some(declared) = self.0.declared.estimators.get(estimator) {
                    step.failed(declared.path, declared.supervisor, message, panicked, Some(estimator));
                }
            }
        }
        step.finish();
    }

    /// A sensor, a service or an actuator has failed.
    pub(crate) fn component_failed(
        &self,
        path: &'static str,
        supervisor: Supervisor,
        message: String,
        panicked: bool,
    ) {
        let mut step = self.step();
        step.line(Event::Failed { path, supervisor, message: message.clone(), panicked });
        step.failed(path, supervisor, message, panicked, None);
        step.finish();
    }

    /// Records a fault that is not a component's failure, or a component that hangs. It is kept, published and
    /// logged, and has no other consequence. Returns the time at which it is reported.
    pub(crate) fn note_fault(&self, path: &'static str, message: String) -> MonotonicTime {
        let mut step = self.step();
        let now = step.now;
        step.note_fault(path, message);
        step.finish();
        now
    }

    /// Watches all estimators from now on.
    pub(crate) fn begin_watch(&self, now: MonotonicTime) {
        self.lock().has_begun = true;
        for (number, declared) in self.0.declared.estimators.iter().enumerate() {
            if let (Some(after), Some(node)) = (declared.health.lost_after_nanos, self.0.nodes.get(number))
                && node.health().is_some()
            {
                node.set_last_run(now);
                self.0.watch.set(number, now.plus_nanos(after));
            }
        }
    }

    /// Checks an estimator whose deadline has passed; returns true if there was one.
    pub(crate) fn check_watch(&self, now: MonotonicTime) -> bool {
        let Some((_, estimator)) = self.0.watch.take(now) else { return false };
        let Some(due) = self.lost_at(estimator) else { return true };
        if due > now {
            self.0.watch.set(estimator, due);
            return true;
        }
        let mut step = self.step();
        if step.state.is_stopping {
            // Its inputs end because the robot stops.
            return true;
        }
        let last_run = self.0.nodes.get(estimator).map_or(MonotonicTime::ZERO, |node| node.last_run());
        step.line(Event::Lost { estimator, last_run });
        step.lost(estimator, last_run);
        step.finish();
        true
    }

    /// Replays the loss of an estimator.
    pub(crate) fn replay_lost(&self, estimator: usize, last_run: MonotonicTime) {
        let mut step = self.step();
        step.lost(estimator, last_run);
        step.finish();
    }

    fn lost_at(&self, estimator: usize) -> Option<MonotonicTime> {
        let after = self.0.declared.estimators.get(estimator)?.health.lost_after_nanos?;
        Some(self.0.nodes.get(estimator)?.last_run().plus_nanos(after))
    }
}

impl Step<'_> {
    fn health_changed(&mut self, estimator: usize, report: HealthReport) {
        let HealthReport { transition, epoch } = report;
        let Some(health) = self.state.health.get_mut(estimator) else { return };
        if health.epoch != epoch {
            // It was declared lost in the meantime, of which it has not been notified yet. It reports again afterwards.
            return;
        }
        let was_lost = health.state == HealthState::Lost;
        health.state = transition.to;
        self.publish_health(estimator, transition);
        if was_lost
            && self.control.0.mode != Mode::Replay
            && let Some(due) = self.control.lost_at(estimator)
        {
            self.control.0.watch.set(estimator, due);
        }
    }

    fn lost(&mut self, estimator: usize, last_run: MonotonicTime) {
        if self.state.has_ended {
            return;
        }
        let Some(health) = self.state.health.get_mut(estimator) else { return };
        if health.state == HealthState::Lost {
            return;
        }
        health.epoch += 1;
        let (from, epoch) = (health.state, health.epoch);
        health.state = HealthState::Lost;
        let Some(declared) = self.control.0.declared.estimators.get(estimator) else { return };
        let source = declared.driver().map_or(declared.path, |driver| driver.source);
        let reason = HealthReason::Lost;
        let transition = HealthTransition {
            estimator: declared.path,
            source,
            from,
            to: HealthState::Lost,
            reason,
            time: self.now,
        };
        self.post(estimator, NodeEntry::Silence { epoch, last_run });
        self.publish_health(estimator, transition);
    }

    fn publish_health(&mut self, estimator: usize, transition: HealthTransition) {
        if let Some(node) = self.control.0.nodes.get(estimator) {
            node.note_transition(transition);
        }
        self.effects.log(Log::Health(transition));
        self.publish(&self.control.0.topics.health, transition, transition.time);
        let declared = self.control.0.declared.estimators.get(estimator);
        let command = declared.and_then(|declared| declared.health.command(transition.from, transition.to));
        if let Some(command) = command {
            // A refusal is counted and published.
            let _ = self.start(command, None, transition.estimator.to_owned(), Some(transition));
        }
    }

    /// A component has failed. A panic counts against its supervisor's budget.
    fn failed(
        &mut self,
        path: &'static str,
        supervisor: Supervisor,
        message: String,
        panicked: bool,
        estimator: Option<usize>,
    ) {
        self.publish_fault(path, message);
        if !panicked {
            return;
        }
        let now = self.now;
        match self.state.budgets.panicked(supervisor, now) {
            Verdict::Restart => {}
            Verdict::RestartAll(above) => {
                for (number, declared) in self.control.0.declared.estimators.iter().enumerate() {
                    if Some(number) != estimator && self.state.budgets.is_below(declared.supervisor, above) {
                        self.post(number, NodeEntry::Restart);
                    }
                }
                for component in &self.state.components {
                    if component.path != path && self.state.budgets.is_below(component.supervisor, above) {
                        (component.order)(ComponentOrder::Restart);
                    }
                }
            }
            Verdict::GiveUp => {
                match estimator {
                    Some(estimator) => self.post(estimator, NodeEntry::GiveUp),
                    None => {
                        let own = self.state.components.iter().filter(|component| component.path == path);
                        own.for_each(|component| (component.order)(ComponentOrder::GiveUp));
                    }
                }
                let message = "panicked too often, and is not restarted any more";
                let error = HardwareError::new(HardwareErrorKind::Panics, message);
                self.hardware_error(SafetyError { path, error });
            }
        }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::control::bare;
    use crate::declaration::EstimatorDeclaration;
    use crate::node::SharedNode;

    static ESTIMATORS: [EstimatorDeclaration; 1] = [EstimatorDeclaration::NONE];

    #[test]
    fn what_an_island_reports_after_the_end_counts_no_more() {
        let node = SharedNode::new(0, &ESTIMATORS[0]);
        let control = bare::control(Mode::Virtual, &ESTIMATORS, [node.clone()]);
        let report = |to| {
            let transition = HealthTransition {
                estimator: "estimator/base/pose",
                source: "sensor/base/imu",
                from: HealthState::Healthy,
                to,
                reason: HealthReason::Diverged,
                time: MonotonicTime::ZERO,
            };
            control.report(0, Report::Health(HealthReport { transition, epoch: 0 }));
        };
        report(HealthState::Degraded);
        assert_eq!((node.statistics().transitions, node.health()), (1, Some(HealthState::Degraded)));
        control.end(drop);
        report(HealthState::Healthy);
        assert_eq!((node.statistics().transitions, node.health()), (1, Some(HealthState::Degraded)));
    }
}
