//! Arming, disarming, and what leads to the safety state `error`.

use super::effects::Effects;
use super::hooks;
use super::machine::IDLE;
use super::step::Step;
use super::system::{Control, Disarming, Limit, Phase, State};
use crate::component::{DisarmHook, Guardian, Permit};
use crate::event::{ArmError, DisarmError, Safety, SafetyError};
use crate::journal::Event;
use crate::node::Mode;
use std::time::Duration;

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

    pub(super) fn is_disarming(&self, generation: u64) -> bool {
        self.disarming.as_ref().is_some_and(|disarming| disarming.generation == generation)
    }

    /// Whether it was disarmed for the last time.
    fn is_stopped(&self) -> bool {
        self.is_stopping && self.disarming.is_none()
    }

    fn disarming_of(&mut self, generation: u64) -> Option<&mut Disarming> {
        self.disarming.as_mut().filter(|disarming| disarming.generation == generation)
    }
}

impl Control {
    /// Arms the robot, unless it is in `error` or stops. Waits until cancelled commands are gone.
    pub(crate) fn arm(&self, permit: &Permit) -> Result<(), ArmError> {
        if !permit.is_valid() {
            return Err(ArmError::Cancelled);
        }
        match self.0.mode {
            Mode::Real => {
                // If it is in vain, the entry finds them still there.
                self.wait_until(ARM_WITHIN, |state| {
                    state.machine.safety != Safety::Disarmed || !state.has_lingering() || state.is_stopping
                });
            }
            Mode::Virtual => self.drop_cancelled(),
            Mode::Replay => {}
        }
        let mut step = self.step();
        // A command may have been cancelled while it waited.
        if !permit.is_valid() {
            return Err(ArmError::Cancelled);
        }
        step.line(Event::Arm);
        let result = step.may_arm();
        if result.is_ok() && step.state.machine.safety == Safety::Disarmed {
            step.state.machine.safety = Safety::Armed;
            step.state.machine.resting = IDLE;
        }
        step.finish();
        result
    }

    /// Disarms the robot: commands are cancelled and the disarm callbacks run. If not everything could be made safe, the
    /// safety state is `error`, which `force` leaves even if something still fails.
    pub(crate) fn disarm(&self, force: bool) -> Result<(), DisarmError> {
        let mut step = self.step();
        if step.state.is_stopped() {
            return step.state.last_disarm.clone();
        }
        let (generation, is_new) = match step.state.machine.safety {
            Safety::Error if !force => return Err(DisarmError::Error),
            Safety::Disarmed if !force => return Ok(()),
            Safety::Disarming => (step.state.generation, false),
            Safety::Armed | Safety::Disarmed | Safety::Error => {
                step.line(Event::Disarm { force });
                let generation = step.begin_disarming(None, None, force);
                (generation, true)
            }
        };
        if !is_new {
            // Somebody else disarms it: wait for the same callbacks.
            step.line(Event::Disarm { force });
            if let Some(disarming) = &mut step.state.disarming {
                disarming.force |= force;
            }
        }
        step.finish();
        match self.0.mode {
            // A callback must not wait for itself.
            Mode::Real | Mode::Virtual if hooks::is_waited_for(self.id()) => return Err(DisarmError::Callback),
            Mode::Real => drop(self.wait_until(DISARM_WITHIN + MARGIN, |state| !state.is_disarming(generation))),
            Mode::Virtual => while self.run_pending_hooks() {},
            Mode::Replay => {}
        }
        let state = self.lock();
        if state.is_disarming(generation) { Err(DisarmError::Unfinished) } else { state.last_disarm.clone() }
    }

    /// In a replay: disarms as the journal has it.
    pub(crate) fn replay_disarm(&self, force: bool) {
        let mut step = self.step();
        match step.state.machine.safety {
            _ if step.state.is_stopped() => {}
            Safety::Error if !force => {}
            Safety::Disarmed if !force => {}
            Safety::Disarming => {
                if let Some(disarming) = &mut step.state.disarming {
                    disarming.force |= force;
                }
            }
            _ => drop(step.begin_disarming(None, None, force)),
        }
        step.finish();
    }

    /// A disarm callback has returned; `None` if there was none to run.
    pub(super) fn hook_returned(&self, generation: u64, index: Option<usize>, error: Option<SafetyError>) {
        let mut step = self.step();
        let Some(disarming) = step.state.disarming_of(generation) else { return };
        disarming.left.retain(|(other, _)| Some(*other) != index);
        disarming.errors.extend(error);
        if disarming.left.is_empty() {
            let errors = std::mem::take(&mut disarming.errors);
            step.disarmed(errors);
        }
    }

    /// The time of the disarm callbacks is over: those that have not returned are not safe.
    pub(super) fn disarm_timeout(&self, generation: u64) {
        let mut step = self.step();
        let Some(disarming) = step.state.disarming_of(generation) else { return };
        let late = std::mem::take(&mut disarming.left).into_iter();
        let mut errors = std::mem::take(&mut disarming.errors);
        errors.extend(
            late.map(|(_, path)| SafetyError { path, message: "did not come back from disarming in time".into() }),
        );
        step.disarmed(errors);
    }

    /// The disarm callbacks have returned, or their time is over.
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

    /// Remembers what makes hardware safe.
    fn remember(&self, path: &'static str, hook: DisarmHook, is_kept: bool) -> u64 {
        let mut state = self.lock();
        if state.has_ended {
            drop(state);
            crate::fault::discard(hook);
            return 0;
        }
        state.hooks.add(path, hook, is_kept)
    }

    /// Of a robot that has ended: what they own is closed, and what they hold of the robot no longer keeps it alive.
    pub(crate) fn forget_all_hooks(&self) {
        let gone = self.lock().hooks.take_all();
        gone.into_iter().for_each(crate::fault::discard);
    }

    /// The same for an actuator's own `disarm`, which restarts do not replace.
    pub(crate) fn on_disarm_always(&self, path: &'static str, hook: DisarmHook) {
        self.remember(path, hook, true);
    }

    /// Runs `make`, which makes the component at `path` or changes it. What it registers replaces what was registered before,
    /// once it has succeeded; `always` even if it registers nothing. There is no time between in which its hardware would not
    /// be made safe.
    pub(crate) fn replacing_hooks<T, E>(
        &self,
        path: &'static str,
        always: bool,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, E> {
        let first = self.lock().hooks.next();
        let made = make();
        let mut state = self.lock();
        let is_replaced = made.is_ok() && (always || state.hooks.any_since(path, first));
        let gone =
            if is_replaced || made.is_err() { state.hooks.take(path, first, is_replaced) } else { Vec::new() };
        drop(state);
        gone.into_iter().for_each(crate::fault::discard);
        made
    }
}

/// In a replay, the journal says what components have reported, and there is no hardware.
impl Guardian for Control {
    fn on_disarm(&self, path: &'static str, hook: DisarmHook) -> u64 {
        match self.0.mode {
            Mode::Replay => 0,
            Mode::Real | Mode::Virtual => self.remember(path, hook, false),
        }
    }

    fn hardware_error(&self, path: &'static str, message: String) {
        if self.0.mode != Mode::Replay {
            self.note_hardware_error(path, message);
        }
    }
}

impl Step<'_> {
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

    /// Motion is inhibited from here on; the disarm callbacks run once the lock is released. The generation.
    pub(super) fn begin_disarming(&mut self, by: Option<u64>, name: Option<&'static str>, force: bool) -> u64 {
        // Those of commands too, which end below.
        let hooks = if self.control.0.mode == Mode::Replay { Vec::new() } else { self.state.hooks.all() };
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
            left: hooks.iter().map(|(path, _)| *path).enumerate().collect(),
            errors: Vec::new(),
        });
        if self.control.0.mode != Mode::Replay {
            let Effects { hooks: waiting, .. } = &mut self.effects;
            *waiting = Some((generation, hooks));
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
        let is_error = disarming.to_error || !(is_safe || disarming.force);
        for error in &errors {
            self.publish_safety_error(error.clone());
        }
        self.state.last_disarm = match is_error {
            _ if !is_safe => Err(DisarmError::Failed(errors)),
            true => Err(DisarmError::Error),
            false => Ok(()),
        };
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
            // Of a robot that is disarmed, something may move all the same.
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
