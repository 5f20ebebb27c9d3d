//! Arming, disarming, and what leads to the safety state `error`.

use super::{Control, Waiting};
use crate::control::safety::{Hook, Safety, SafetyError, disarm, disarm_in_order};
use crate::control::state::IDLE;
use crate::control::tasks::lock;

impl Control {
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

    pub(super) fn disarm_except(&self, except: Option<u64>, command: Option<&'static str>, force: bool) -> bool {
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

    pub(super) fn carry_out_giving_up(&self, path: &'static str) {
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
}
