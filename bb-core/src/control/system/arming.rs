//! Arming, disarming, and what leads to the safety state `error`.

use super::changes::Change;
use super::{Control, Waiting};
use crate::control::safety::{DISARM_WITHIN, Hook, Safety, SafetyError, disarm, disarm_in_order};
use crate::control::state::IDLE;
use crate::control::tasks::lock;
use crate::journal::Event;
use crate::time::MonotonicTime;
use std::time::{Duration, Instant};

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
        state.note(now, Change::Machine(before, after, None));
        drop(state);
        self.tell();
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
        state.note(now, Change::Machine(before, between, command));
        state.tasks.iter().filter(|task| Some(task.id) != except).for_each(|task| task.cancel());
        drop(state);
        self.tell();
        let hooks = lock(&self.0.hooks).all();
        let errors = match lock(&self.0.replayed_answer).take() {
            Some(errors) => errors,
            None if self.0.clock.is_virtual() => disarm_in_order(hooks),
            None => disarm(hooks),
        };
        if let Some(journal) = self.0.journal.as_ref().filter(|_| !errors.is_empty()) {
            journal.could_not_be_made_safe(now, errors.clone());
        }
        let is_safe = errors.is_empty();
        for error in errors {
            self.report(error, now);
        }
        let mut state = lock(&self.0.state);
        let before = state.machine;
        // Unless a component was given up meanwhile, which is an error whatever is safe now.
        if before.safety == Safety::Disarming {
            state.machine.safety = if is_safe || force { Safety::Disarmed } else { Safety::Error };
        }
        let after = state.machine;
        state.note(now, Change::Machine(before, after, command));
        drop(state);
        self.tell();
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
        let message = "failed too often, and is not started anew any more".into();
        self.report(SafetyError { path, message }, now);
        self.disarm_except(None, None, false, now);
        let mut state = lock(&self.0.state);
        let before = state.machine;
        state.machine.safety = Safety::Error;
        let after = state.machine;
        state.note(now, Change::Machine(before, after, None));
        drop(state);
        self.tell();
    }

    /// Waits until whoever disarms the robot has done so: no longer than that may take.
    pub(super) fn wait_for_disarm(&self) {
        let start = Instant::now();
        let longest = DISARM_WITHIN + Duration::from_secs(1);
        while !self.0.clock.is_virtual() && self.safety() == Safety::Disarming && start.elapsed() < longest {
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn report(&self, error: SafetyError, now: MonotonicTime) {
        tracing::error!(component = error.path, message = error.message, "safety error");
        self.publish(&self.0.topics.safety_error, error, now);
    }

    /// Remembers what makes hardware safe.
    pub(crate) fn on_disarm(&self, path: &'static str, hook: Hook) {
        lock(&self.0.hooks).add(path, hook);
    }

    /// Runs `make`, which makes the component at `path` anew or changes it. What it registers takes the place of what was
    /// registered before, once it has succeeded; `always` even if it registers nothing. There is no time between in which
    /// its hardware would not be made safe.
    pub(crate) fn replacing_hooks<T, E>(
        &self,
        path: &'static str,
        always: bool,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        let first = lock(&self.0.hooks).next();
        let made = make();
        let mut hooks = lock(&self.0.hooks);
        let is_replaced = made.is_ok() && (always || hooks.any_since(path, first));
        let gone = if is_replaced || made.is_err() { hooks.take(path, first, is_replaced) } else { Vec::new() };
        drop(hooks);
        drop(gone);
        made
    }
}
