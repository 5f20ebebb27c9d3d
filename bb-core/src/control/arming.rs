//! Arming, disarming and stopping, and the causes of the safety state `error`.
//!
//! - **Disarming** changes the state first: actuators check it before every command, so nothing moves from then on. Then commands are
//!   cancelled and all disarm callbacks run at once, each on its own thread. It ends when they have returned, or after
//!   [`DISARM_WITHIN`]; one that has failed or has not returned is not safe, and the state is `error`.
//! - **Arming** waits until the code of cancelled commands has returned and nothing is being made safe, [`ARM_WITHIN`] at most. A
//!   disarming that is requested meanwhile wins.
//! - **Stopping** disarms, whatever the state, and starts nothing any more. Sensors and services are told to stop once the robot is
//!   safe or the time limit has passed. Nobody waits for longer than the limits, whatever hangs.

use super::callbacks::{Reason, is_awaited};
use super::step::{IDLE, Step};
use super::{Control, Disarming, Limit, RunningCommand, State};
use crate::component::{Caller, SafetyControls};
use crate::event::{ArmError, DisarmError, HardwareError, HardwareErrorKind, Safety, SafetyError};
use crate::fault::Fault;
use crate::journal::Event;
use crate::node::Mode;
use crate::time::MonotonicTime;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time that disarm callbacks may take.
pub(crate) const DISARM_WITHIN: Duration = Duration::from_secs(5);

/// Time for which arming waits for the code of cancelled commands to return.
pub(super) const ARM_WITHIN: Duration = Duration::from_secs(5);

/// The longest wait in one piece.
const LONGEST_WAIT: Duration = Duration::from_secs(3600);

/// Time for which [`Control::disarm`] waits beyond the callbacks' limit.
const MARGIN: Duration = Duration::from_secs(1);

impl State {
    /// Returns whether the code of a cancelled command has not returned yet.
    pub(super) fn has_lingering(&self) -> bool {
        self.executions.iter().any(RunningCommand::is_lingering)
    }

    /// Returns whether the code of a command, or a disarm callback outside of a disarming, has not returned.
    fn is_anything_inside(&self) -> bool {
        !self.apart.is_empty() || self.executions.iter().any(RunningCommand::is_inside)
    }

    /// Returns the number of disarmings that have ended.
    pub(super) fn ended_disarmings(&self) -> u64 {
        self.generation - u64::from(self.disarming.is_some())
    }

    pub(super) fn is_disarming(&self, generation: u64) -> bool {
        self.disarming.as_ref().is_some_and(|disarming| disarming.generation == generation)
    }

    /// Returns whether the last disarming is over.
    pub(super) fn is_stopped(&self) -> bool {
        self.is_stopping && self.disarming.is_none()
    }

    fn disarming_of(&mut self, generation: u64) -> Option<&mut Disarming> {
        self.disarming.as_mut().filter(|disarming| disarming.generation == generation)
    }
}

impl SafetyControls for Control {
    /// Arms the robot, unless it is in `error` or stopping.
    fn arm(&self, caller: &Caller) -> Result<(), ArmError> {
        if self.0.mode == Mode::Replay {
            return Err(ArmError::Replay);
        }
        let disarms = self.lock().disarms;
        if !caller.is_valid() {
            return Err(ArmError::Cancelled);
        }
        let may_wait = self.0.mode == Mode::Real && !is_awaited(self.id());
        let longest = if may_wait { ARM_WITHIN } else { Duration::ZERO };
        if self.0.mode == Mode::Virtual {
            self.drop_cancelled();
        }
        // If the wait fails, they are still there below.
        let mut step = self.step_once(longest, |state| {
            state.machine.safety != Safety::Disarmed
                || !state.has_lingering() && state.apart.is_empty()
                || state.is_stopping
                || state.disarms != disarms
        });
        // The command may have been cancelled while this waited, or the robot disarmed.
        let Ok(_permit) = caller.permit() else { return Err(ArmError::Cancelled) };
        if step.state.disarms != disarms {
            return Err(ArmError::Cancelled);
        }
        if step.state.machine.safety == Safety::Disarmed && !step.state.is_stopping && !step.state.apart.is_empty()
        {
            // A replay knows nothing of those callbacks, so there is no entry.
            return Err(ArmError::MakingSafe(step.state.being_made_safe().collect()));
        }
        step.asked_by = Some(caller.name().to_owned());
        step.line(Event::Arm { caller: caller.name().to_owned() });
        step.arm()
    }

    /// Disarms the robot: commands are cancelled and the disarm callbacks run. If not everything could be made safe,
    /// the safety state is `error`; with `force`, that state is left even if something still fails. If the robot is
    /// disarmed already, commands that would arm it are cancelled. Without a permit, the caller may not force it, but still disarm.
    fn disarm(&self, force: bool, caller: &Caller) -> Result<(), DisarmError> {
        if self.0.mode == Mode::Replay {
            return Err(DisarmError::Replay);
        }
        let mut step = self.step();
        let permit = if force { caller.permit().ok() } else { None };
        let force = permit.is_some();
        match step.state.machine.safety {
            Safety::Error if step.state.is_stopped() && step.state.last_disarm.is_ok() => {
                return Err(DisarmError::Error);
            }
            _ if step.state.is_stopped() => return step.state.last_disarm.clone(),
            Safety::Error if !force => return Err(DisarmError::Error),
            _ => {}
        }
        step.asked_by = Some(caller.name().to_owned());
        step.line(Event::Disarm { force, caller: caller.name().to_owned() });
        step.disarm(force);
        let disarming = step.state.disarming.as_ref();
        let waits_for = disarming.map(|disarming| (disarming.generation, Arc::clone(&disarming.outcome)));
        let Some((generation, outcome)) = waits_for else {
            step.finish();
            return Ok(());
        };
        step.finish();
        drop(permit);
        if is_awaited(self.id()) {
            return Err(DisarmError::Callback);
        }
        if self.0.mode == Mode::Real {
            self.wait_until(DISARM_WITHIN + MARGIN, |state| !state.is_disarming(generation));
        } else {
            while self.run_pending_hooks() {}
        }
        outcome.get().cloned().unwrap_or(Err(DisarmError::Unfinished))
    }

    fn request_stop(&self, caller: &Caller) -> Result<(), Fault> {
        let _permit = caller.permit()?;
        self.begin_stop(caller);
        Ok(())
    }
}

impl Control {
    /// Replays a request to arm the robot.
    pub(crate) fn replay_arm(&self, caller: String) {
        let mut step = self.step();
        step.asked_by = Some(caller);
        // Whether it succeeds follows from the state.
        let _ = step.arm();
    }

    /// Replays a request to disarm the robot.
    pub(crate) fn replay_disarm(&self, force: bool, caller: String) {
        let mut step = self.step();
        step.asked_by = Some(caller);
        if !step.state.is_stopped() {
            step.disarm(force);
        }
        step.finish();
    }

    /// A disarm callback has returned that ran because the robot is disarmed; `None` if there was none to run.
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
            step.disarmed(errors);
        }
    }

    /// The time limit of the disarm callbacks has passed: those that have not returned are not safe.
    pub(super) fn disarm_timeout(&self, generation: u64) {
        let mut step = self.step();
        let Some(disarming) = step.state.disarming_of(generation) else { return };
        let late = std::mem::take(&mut disarming.left).into_iter();
        let mut errors = std::mem::take(&mut disarming.errors);
        errors.extend(late.map(|(_, path)| late_at(path)));
        step.disarmed(errors);
    }

    /// The disarm callbacks have returned, or their time limit has passed.
    pub(crate) fn disarmed(&self, errors: Vec<SafetyError>) {
        let step = self.step();
        if step.state.disarming.is_some() {
            step.disarmed(errors);
        }
    }

    /// Returns whether the disarm callbacks run.
    pub(crate) fn is_disarming(&self) -> bool {
        self.lock().disarming.is_some()
    }

    /// Hardware is in a dangerous state: the robot is disarmed, and in `error`.
    pub(crate) fn note_hardware_error(&self, path: &'static str, error: HardwareError) {
        let mut step = self.step();
        step.line(Event::HardwareError { path, error: error.clone() });
        step.hardware_error(SafetyError { path, error });
        step.finish();
    }

    /// Drops, for a robot that has ended, the callbacks of all components, so that the resources they own are closed and their references
    /// no longer keep the robot alive.
    pub(crate) fn drop_hooks(&self) {
        let mut step = self.step();
        let hooks = step.state.hooks.take_all();
        step.forget(hooks);
        step.finish();
    }

    /// Disarms the robot and cancels its commands, without waiting. Nothing is started from now on. Sensors and services are
    /// told to stop once the robot is safe or the time limit has passed.
    pub(crate) fn begin_stop(&self, caller: &Caller) {
        let mut step = self.step();
        if step.state.is_stopping {
            return;
        }
        step.asked_by = Some(caller.name().to_owned());
        step.line(Event::Stop { caller: caller.name().to_owned() });
        step.begin_stop();
        step.finish();
        if self.0.mode == Mode::Virtual {
            while self.run_pending_hooks() {}
            self.drop_cancelled();
        }
    }

    /// Replays a stop of the robot.
    pub(crate) fn replay_stop(&self, caller: String) {
        let mut step = self.step();
        if step.state.is_stopping {
            return;
        }
        step.asked_by = Some(caller);
        step.begin_stop();
        step.finish();
    }

    /// Waits until the disarm callbacks have returned or have timed out.
    pub(crate) fn wait_until_disarmed(&self) {
        if self.0.mode == Mode::Real {
            let generation = self.lock().generation;
            let is_over = |state: &State| !state.is_disarming(generation);
            if !self.wait_until(DISARM_WITHIN + Duration::from_millis(500), is_over) {
                // The timekeeper's thread is gone.
                self.disarm_timeout(generation);
            }
            self.0.stop.set();
        }
    }

    /// Sets the number of sensors and services, each of which has a thread of its own.
    pub(crate) fn begin_sources(&self, sources: usize) {
        self.lock().sources = sources;
    }

    /// Counts one of them less: its thread ends.
    pub(crate) fn end_source(&self) {
        let mut state = self.lock();
        state.sources = state.sources.saturating_sub(1);
        drop(state);
        self.0.changed.notify_all();
    }

    /// Waits until all of them have ended, or the robot is told to stop. Returns whether they have ended.
    pub(crate) fn wait_for_sources(&self) -> bool {
        while !self.wait_until(LONGEST_WAIT, |state| state.sources == 0 || state.is_stopping) {}
        self.lock().sources == 0
    }

    /// The paths of commands whose code has not returned at `deadline`, and of components whose disarm callbacks have not.
    pub(crate) fn lingering(&self, deadline: Instant) -> Vec<&'static str> {
        self.wait_until(deadline.saturating_duration_since(Instant::now()), |state| !state.is_anything_inside());
        let state = self.lock();
        let inside = state.executions.iter().filter(|execution| execution.is_inside());
        let inside = inside.filter_map(|execution| self.0.declared.commands.get(execution.command));
        inside.map(|declared| declared.path).chain(state.being_made_safe()).collect()
    }

    /// Enforces the time limits that have passed; returns true if there were any.
    pub(crate) fn check_limits(&self, now: MonotonicTime) -> bool {
        let Some((_, limit)) = self.0.limits.take(now) else { return false };
        match limit {
            Limit::Execution(id) => self.timed_out(id),
            Limit::Arming => self.arm_timeout(),
            Limit::Disarming(generation) => self.disarm_timeout(generation),
            Limit::Apart(key) => self.apart_timeout(key),
        }
        true
    }

    /// Wakes a sleeper that is due. Returns true if there was one.
    pub(crate) fn wake_sleepers(&self, now: MonotonicTime) -> bool {
        let Some((lane, waker)) = self.0.sleeper.take(now) else { return false };
        let control = self.clone();
        self.run_on_pool(lane, move || control.wake(waker));
        true
    }

    /// Wakes `waker` at that time.
    pub(crate) fn wake_at(&self, time: MonotonicTime, waker: std::task::Waker) {
        self.0.sleeper.wake_at(time, None, waker);
    }

    /// Time of the watchdog's next check.
    pub(crate) fn next_watch(&self) -> Option<MonotonicTime> {
        self.0.watch.next()
    }

    /// Time at which a command is to be woken next.
    pub(crate) fn next_sleeper(&self) -> Option<MonotonicTime> {
        self.0.sleeper.next()
    }

    /// Time at which the next limit passes.
    pub(crate) fn next_limit(&self) -> Option<MonotonicTime> {
        self.0.limits.next()
    }
}

/// The disarm callback of a component did not return.
pub(super) fn late_at(path: &'static str) -> SafetyError {
    let message = "did not come back from disarming in time";
    SafetyError { path, error: HardwareError::new(HardwareErrorKind::NotMadeSafe, message) }
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

    /// Disarms in any safety state: hardware started while the robot was disarmed may move as well.
    fn begin_stop(&mut self) {
        let was_in_error = self.state.machine.safety == Safety::Error;
        if self.state.disarming.is_none() {
            self.begin_disarming(None, None, false);
        }
        if let Some(disarming) = self.state.disarming.as_mut().filter(|_| was_in_error) {
            disarming.to_error = true;
        }
        self.state.is_stopping = true;
        self.cancel_all(None);
        self.publish_machine(None);
    }

    /// Checks that the robot is armed or may be.
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
        let lingering = executions.filter(|execution| execution.is_lingering());
        lingering.filter_map(|execution| self.declared(execution.command)).map(|declared| declared.path).collect()
    }

    /// Motion is inhibited from here on; the disarm callbacks run once the lock is released. Returns the generation.
    pub(super) fn begin_disarming(&mut self, by: Option<u64>, name: Option<&'static str>, force: bool) -> u64 {
        // Includes the callbacks of commands, which end below.
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
            asked_by: self.asked_by.clone(),
            left: hooks.iter().map(|callback| (callback.number, callback.path)).collect(),
            errors: Vec::new(),
            outcome: Arc::default(),
        });
        if self.control.0.mode != Mode::Replay {
            self.effects.callbacks.push((Reason::Disarming(generation), hooks));
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
        self.asked_by = disarming.asked_by;
        self.publish_machine(name);
        if let Some(id) = disarming.by {
            self.finish_disarming_command(id);
        }
        if self.state.is_stopping {
            self.control.0.stop.set();
        }
        self.finish();
    }

    /// Handles a hardware error, see [`Control::hardware_error`].
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
