//! Arming, disarming, and what leads to the safety state `error`.

use super::{Control, Waiting};
use crate::control::safety::{Hook, Safety, SafetyError, disarm, disarm_in_order};
use crate::control::state::IDLE;
use crate::control::tasks::lock;
use crate::journal::Event;
use crate::time::MonotonicTime;

impl Control {
    pub(crate) fn safety(&self) -> Safety {
        lock(&self.0.state).machine.safety
    }

    /// Arms the robot, unless it is in `error`.
    pub(crate) fn arm(&self, now: MonotonicTime) -> bool {
        let _acting = self.act();
        let mut state = lock(&self.0.state);
        self.write(now, Event::Arm);
        let before = state.machine;
        if before.safety == Safety::Disarmed && !state.is_stopping {
            state.machine.safety = Safety::Armed;
            state.machine.resting = IDLE;
        }
        let after = state.machine;
        drop(state);
        self.publish_changes(before, after, None, now);
        after.safety == Safety::Armed
    }

    /// Disarms the robot: commands are cancelled, and whoever owns hardware makes it safe. True if all could; else the
    /// safety state is `error`, out of which `force` leads even if something still fails.
    pub(crate) fn disarm(&self, force: bool, now: MonotonicTime) -> bool {
        let _acting = self.act();
        self.write(now, Event::Disarm { force });
        self.disarm_except(None, None, force, now)
    }

    pub(super) fn disarm_except(
        &self,
        except: Option<u64>,
        command: Option<&'static str>,
        force: bool,
        now: MonotonicTime,
    ) -> bool {
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
        self.publish_changes(before, between, command, now);
        let hooks = lock(&self.0.hooks).clone();
        let errors = match lock(&self.0.replayed_answer).take() {
            Some(errors) => errors,
            None if self.0.clock.is_virtual() => disarm_in_order(hooks),
            None => disarm(hooks),
        };
        if let Some(journal) = self.0.journal.as_ref().filter(|_| !errors.is_empty()) {
            journal.could_not_be_made_safe(now, errors.clone());
        }
        let is_safe = errors.is_empty();
        let after = {
            let mut state = lock(&self.0.state);
            state.machine.safety = if is_safe || force { Safety::Disarmed } else { Safety::Error };
            state.machine
        };
        for error in errors {
            self.report(error, now);
        }
        self.publish_changes(between, after, command, now);
        is_safe
    }

    /// What making hardware safe answers the next time, as a journal has it.
    pub(crate) fn replay_answer(&self, errors: Option<Vec<SafetyError>>) {
        *lock(&self.0.replayed_answer) = errors;
    }

    /// A component has failed too often: the robot is disarmed, and in `error`.
    pub(crate) fn give_up(&self, path: &'static str) {
        self.leave(Waiting::GiveUp(path));
    }

    pub(super) fn carry_out_giving_up(&self, path: &'static str, now: MonotonicTime) {
        self.report(
            SafetyError { path, message: "failed too often, and is not started anew any more".into() },
            now,
        );
        self.disarm_except(None, None, false, now);
        let (before, after) = {
            let mut state = lock(&self.0.state);
            let before = state.machine;
            state.machine.safety = Safety::Error;
            (before, state.machine)
        };
        self.publish_changes(before, after, None, now);
    }

    fn report(&self, error: SafetyError, now: MonotonicTime) {
        tracing::error!(component = error.path, message = error.message, "safety error");
        self.publish(&self.0.topics.safety_error, error, now);
    }

    /// Remembers what makes hardware safe.
    pub(crate) fn on_disarm(&self, path: &'static str, hook: Hook) {
        lock(&self.0.hooks).push((path, hook));
    }
}
