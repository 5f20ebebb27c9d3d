//! Arming, disarming, and the causes of the safety state `error`.

use super::callback::Reason;
use super::hooks::Hooks;
use super::inside::{self, Awaited};
use super::machine::IDLE;
use super::step::Step;
use super::{Control, Disarming, Limit, Phase, State};
use crate::component::Permit;
use crate::event::{ArmError, DisarmError, Safety, SafetyError};
use crate::journal::Event;
use crate::node::Mode;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long disarm callbacks may take.
pub(crate) const DISARM_WITHIN: Duration = Duration::from_secs(5);

/// How long arming waits for the code of cancelled commands to return.
pub(super) const ARM_WITHIN: Duration = Duration::from_secs(5);

/// How long [`Control::disarm`] waits beyond the callbacks' limit.
const MARGIN: Duration = Duration::from_secs(1);

impl State {
    /// Whether the code of a cancelled command has not returned yet.
    pub(super) fn has_lingering(&self) -> bool {
        self.executions.iter().any(|execution| matches!(execution.phase, Phase::Lingering))
    }

    /// How many disarmings have ended.
    pub(super) fn ended_disarmings(&self) -> u64 {
        self.generation - u64::from(self.disarming.is_some())
    }

    pub(super) fn is_disarming(&self, generation: u64) -> bool {
        self.disarming.as_ref().is_some_and(|disarming| disarming.generation == generation)
    }

    /// Whether the last disarming is over.
    pub(super) fn is_stopped(&self) -> bool {
        self.is_stopping && self.disarming.is_none()
    }

    fn disarming_of(&mut self, generation: u64) -> Option<&mut Disarming> {
        self.disarming.as_mut().filter(|disarming| disarming.generation == generation)
    }
}

impl Control {
    /// Arms the robot, unless it is in `error` or stopping. Waits until cancelled commands are gone, and until what was started on
    /// the disarmed robot has been made safe.
    pub(crate) fn arm(&self, permit: &Permit) -> Result<(), ArmError> {
        if self.0.mode == Mode::Replay {
            return Err(ArmError::Replay);
        }
        let disarms = self.lock().disarms;
        if !permit.is_valid() {
            return Err(ArmError::Cancelled);
        }
        let deadline = Instant::now() + ARM_WITHIN;
        loop {
            // Code that is itself waited for does not wait.
            let waits = inside::waits_for(self.id());
            if self.0.mode == Mode::Real {
                let left = deadline.saturating_duration_since(Instant::now());
                // If the wait fails, they are still there below.
                self.wait_until(left, |state| {
                    state.machine.safety != Safety::Disarmed
                        || !(state.has_lingering() || state.is_making_safe() && waits.is_some())
                        || state.is_stopping
                        || state.disarms != disarms
                });
            } else {
                self.drop_cancelled();
            }
            let step = self.step();
            // The command may have been cancelled while this waited, or the robot disarmed.
            if !permit.is_valid() || step.state.disarms != disarms {
                return Err(ArmError::Cancelled);
            }
            let may_turn = step.state.machine.safety == Safety::Disarmed && step.state.is_making_safe();
            if !may_turn || step.state.is_stopping {
                step.line(Event::Arm);
                return step.arm();
            }
            // A replay knows nothing of those callbacks, so there is no entry. A device that is unplugged is started again and
            // again, so they may be those of another start.
            let may_wait = self.0.mode == Mode::Real && waits.is_some() && !cfg!(loom);
            if !may_wait || Instant::now() >= deadline {
                return Err(ArmError::MakingSafe(step.state.being_made_safe()));
            }
        }
    }

    /// In a replay: arming was requested.
    pub(crate) fn replay_arm(&self) {
        // Whether it succeeds follows from the state.
        let _ = self.step().arm();
    }

    /// Disarms the robot: commands are cancelled and the disarm callbacks run. If not everything could be made safe,
    /// the safety state is `error`; with `force`, that state is left even if something still fails. If the robot is
    /// disarmed already, commands that would arm it are cancelled.
    pub(crate) fn disarm(&self, force: bool) -> Result<(), DisarmError> {
        if self.0.mode == Mode::Replay {
            return Err(DisarmError::Replay);
        }
        let mut step = self.step();
        match step.state.machine.safety {
            Safety::Error if step.state.is_stopped() && step.state.last_disarm.is_ok() => {
                return Err(DisarmError::Error);
            }
            _ if step.state.is_stopped() => return step.state.last_disarm.clone(),
            Safety::Error if !force => return Err(DisarmError::Error),
            _ => {}
        }
        step.line(Event::Disarm { force });
        step.disarm(force);
        let disarming = step.state.disarming.as_ref();
        let waits_for = disarming.map(|disarming| (disarming.generation, Arc::clone(&disarming.outcome)));
        let Some((generation, outcome)) = waits_for else {
            step.finish();
            return Ok(());
        };
        // Before the callbacks begin: if robots disarm each other, the one that closes the cycle gets the error.
        let waits = inside::waits_for(self.id());
        step.finish();
        let Some(_waits) = waits else { return Err(DisarmError::Callback) };
        if self.0.mode == Mode::Real {
            self.wait_until(DISARM_WITHIN + MARGIN, |state| !state.is_disarming(generation));
        } else {
            while self.run_pending_hooks() {}
        }
        outcome.get().cloned().unwrap_or(Err(DisarmError::Unfinished))
    }

    /// In a replay: disarming was requested.
    pub(crate) fn replay_disarm(&self, force: bool) {
        let mut step = self.step();
        if !step.state.is_stopped() {
            step.disarm(force);
        }
        step.finish();
    }

    /// Whether some caller waits for a callback to run for that reason.
    pub(super) fn is_wanted(&self, reason: Reason, number: u64) -> bool {
        let state = self.lock();
        match reason {
            Reason::Disarming(generation) => {
                let disarming = state.disarming.as_ref().filter(|disarming| disarming.generation == generation);
                disarming.is_some_and(|disarming| disarming.left.iter().any(|(other, _)| *other == number))
            }
            Reason::Apart(key) => state.is_apart(key, number),
        }
    }

    /// A disarm callback has returned.
    pub(super) fn callback_returned(&self, reason: Reason, number: u64, error: Option<SafetyError>) {
        match reason {
            Reason::Disarming(generation) => self.hook_returned(generation, Some(number), error),
            Reason::Apart(key) => self.apart_returned(key, number, error),
        }
    }

    /// The same for one that runs because the robot is disarmed; `None` if there was none to run.
    pub(super) fn hook_returned(&self, generation: u64, number: Option<u64>, error: Option<SafetyError>) {
        let mut step = self.step();
        let Some(disarming) = step.state.disarming_of(generation) else { return };
        // It is listed once per request.
        if let Some(index) = disarming.left.iter().position(|(other, _)| Some(*other) == number) {
            disarming.left.remove(index);
        }
        disarming.errors.extend(error);
        if disarming.left.is_empty() {
            let errors = std::mem::take(&mut disarming.errors);
            return step.disarmed(errors);
        }
        // A stop may wait for all callbacks but the one that has called it.
        step.finish();
    }

    /// The time limit of the disarm callbacks has passed: those that have not returned are not safe.
    pub(super) fn disarm_timeout(&self, generation: u64) {
        let mut step = self.step();
        let Some(disarming) = step.state.disarming_of(generation) else { return };
        let late = std::mem::take(&mut disarming.left).into_iter();
        let mut errors = std::mem::take(&mut disarming.errors);
        let (robot, hooks) = (self.id(), &step.state.hooks);
        errors.extend(late.map(|(number, path)| match is_caller_awaited(robot, hooks, number, path) {
            true => own_code_at(path),
            false => late_at(path),
        }));
        step.disarmed(errors);
    }

    /// Whether that disarming is over, or all callbacks that have not returned wait for the calling thread.
    pub(super) fn is_disarmed_but_for_caller(&self, state: &State, generation: u64) -> bool {
        let Some(disarming) = state.disarming.as_ref().filter(|disarming| disarming.generation == generation)
        else {
            return true;
        };
        let mut left = disarming.left.iter();
        left.all(|(number, path)| is_caller_awaited(self.id(), &state.hooks, *number, path))
    }

    /// The disarm callbacks have returned, or their time limit has passed.
    pub(crate) fn disarmed(&self, errors: Vec<SafetyError>) {
        let step = self.step();
        if step.state.disarming.is_some() {
            step.disarmed(errors);
        }
    }

    /// Whether the disarm callbacks run.
    pub(crate) fn is_disarming(&self) -> bool {
        self.lock().disarming.is_some()
    }

    /// Hardware is in a dangerous state: the robot is disarmed, and in `error`.
    pub(crate) fn note_hardware_error(&self, path: &'static str, message: String) {
        let mut step = self.step();
        step.line(Event::HardwareError { path, message: message.clone() });
        step.hardware_error(SafetyError { path, message });
        step.finish();
    }

    /// For a robot that has ended: the callbacks of all components. The caller drops them, so that the resources they
    /// own are closed and their references no longer keep the robot alive. Callbacks of commands whose code has not
    /// returned stay, and run once it has.
    pub(crate) fn take_all_hooks(&self) -> Vec<(&'static str, impl Send + Sync + use<>)> {
        let state = &mut *self.lock();
        let lingering = state.executions.iter().filter(|execution| matches!(execution.phase, Phase::Lingering));
        let lingering: Vec<_> = lingering.map(|execution| execution.id).collect();
        let gone = state.hooks.take_but_of(&lingering).into_iter();
        gone.map(|callback| (callback.path, callback)).collect()
    }
}

/// Whether a disarm callback waits for code of the calling thread.
fn is_caller_awaited(robot: Awaited, hooks: &Hooks, number: u64, path: &'static str) -> bool {
    inside::is_callback_waiting(robot, number, hooks.is_of_actuator(number).then_some(path))
}

/// The code of a component stops the robot, and its disarm callback waits for that code.
fn own_code_at(path: &'static str) -> SafetyError {
    SafetyError { path, message: "its own code stops the robot, and cannot wait for it to be disarmed".to_owned() }
}

/// The disarm callback of a component did not return.
pub(super) fn late_at(path: &'static str) -> SafetyError {
    SafetyError { path, message: "did not come back from disarming in time".to_owned() }
}

impl Step<'_> {
    /// Arms the robot if it may be armed.
    fn arm(mut self) -> Result<(), ArmError> {
        let result = self.may_arm();
        if result.is_ok() && self.state.machine.safety == Safety::Disarmed {
            self.state.machine.safety = Safety::Armed;
            self.state.machine.resting = IDLE;
        }
        self.finish();
        result
    }

    /// Begins to disarm the robot, or upgrades the current disarming to a forced one.
    fn disarm(&mut self, force: bool) {
        self.state.disarms += 1;
        match self.state.machine.safety {
            Safety::Error if !force => {}
            Safety::Disarmed if !force => self.cancel_arming(),
            Safety::Disarming => {
                if let Some(disarming) = &mut self.state.disarming {
                    disarming.force |= force;
                }
            }
            Safety::Armed | Safety::Disarmed | Safety::Error => {
                self.begin_disarming(None, None, force);
            }
        }
    }

    /// Whether the robot is armed or may be.
    fn may_arm(&self) -> Result<(), ArmError> {
        match self.state.machine.safety {
            Safety::Armed => Ok(()),
            Safety::Error => Err(ArmError::Error),
            _ if self.state.is_stopping => Err(ArmError::Stopping),
            Safety::Disarming => Err(ArmError::Disarming),
            Safety::Disarmed if self.state.has_lingering() => Err(ArmError::Lingering(self.lingering())),
            Safety::Disarmed => Ok(()),
        }
    }

    /// The paths of commands that were cancelled and whose code has not returned.
    fn lingering(&self) -> Vec<&'static str> {
        let executions = self.state.executions.iter();
        let lingering = executions.filter(|execution| matches!(execution.phase, Phase::Lingering));
        lingering.filter_map(|execution| self.declared(execution.command)).map(|declared| declared.path).collect()
    }

    /// Motion is inhibited from here on; the disarm callbacks run once the lock is released. Returns the generation.
    pub(super) fn begin_disarming(&mut self, by: Option<u64>, name: Option<&'static str>, force: bool) -> u64 {
        // Includes the callbacks of commands, which end below.
        let hooks = if self.control.0.mode == Mode::Replay { Vec::new() } else { self.state.hooks.all() };
        for execution in &mut self.state.executions {
            let may_act = || execution.task.as_ref().is_some_and(|task| task.may_act());
            execution.lingers_on |= matches!(execution.phase, Phase::Lingering) && may_act();
        }
        self.state.machine.safety = Safety::Disarming;
        self.state.generation += 1;
        let generation = self.state.generation;
        self.publish_machine(name);
        self.cancel_all(by);
        self.state.disarming = Some(Disarming {
            generation,
            force,
            to_error: false,
            by,
            left: hooks.iter().map(|callback| (callback.number, callback.path)).collect(),
            errors: Vec::new(),
            outcome: Arc::default(),
        });
        if self.control.0.mode != Mode::Replay {
            self.effects.hooks.push((generation, hooks));
        }
        if self.control.0.mode == Mode::Real {
            self.control.0.limits.set(Limit::Disarming(generation), self.now + DISARM_WITHIN);
        }
        generation
    }

    /// The disarm callbacks have returned with these errors.
    fn disarmed(mut self, errors: Vec<SafetyError>) {
        let Some(disarming) = self.state.disarming.take() else { return };
        self.line(Event::Disarmed { errors: errors.clone() });
        self.control.0.limits.clear(Limit::Disarming(disarming.generation));
        let is_safe = errors.is_empty();
        // Force ignores callbacks that fail, except on a robot that is stopping and cannot be disarmed again.
        let is_forgiven = disarming.force && !self.state.is_stopping;
        let is_error = disarming.to_error || !(is_safe || is_forgiven);
        for error in &errors {
            self.publish_safety_error(error.clone());
        }
        let outcome = match is_error {
            _ if !is_safe => Err(DisarmError::Failed(errors)),
            true => Err(DisarmError::Error),
            false => Ok(()),
        };
        // It is set only here.
        let _ = disarming.outcome.set(outcome.clone());
        self.state.last_disarm = outcome;
        self.state.machine.safety = if is_error { Safety::Error } else { Safety::Disarmed };
        let name = disarming.by.and_then(|id| self.name_of(id));
        self.publish_machine(name);
        if let Some(id) = disarming.by {
            self.finish_disarming_command(id);
        }
        if self.state.is_stopping {
            self.control.0.stop.set();
        }
        self.finish();
    }

    /// See [`Control::hardware_error`].
    pub(super) fn hardware_error(&mut self, error: SafetyError) {
        self.publish_safety_error(error);
        match self.state.machine.safety {
            // Something on a disarmed robot may still move.
            Safety::Armed | Safety::Disarmed if !self.state.is_stopped() => {
                self.begin_disarming(None, None, false);
            }
            Safety::Armed | Safety::Disarmed => self.state.machine.safety = Safety::Error,
            Safety::Disarming | Safety::Error => {}
        }
        if let Some(disarming) = &mut self.state.disarming {
            disarming.to_error = true;
        }
        self.publish_machine(None);
    }
}
