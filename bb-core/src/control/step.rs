//! One entry of the control state, and the operational state that it may change.
//!
//! An entry takes the lock ([`Control::step`]), reads the clock, writes its line, changes the state, and releases the lock
//! ([`Step::finish`]), in this order: lines are in the order of their times and of the changes. What it publishes is queued under the
//! lock; subscribers are woken and user code is called by its [`Effects`], after the lock is released.
//!
//! The operational state is `disarmed`, a declared state, or `idle`, which is `executing` while a command runs.

use super::effects::{Effects, Log};
use super::{Control, State, StateGuard};
use crate::event::{ComponentFault, Safety, SafetyError, SafetyTransition, StateTransition};
use crate::journal::Event;
use crate::message::{Payload, Stamp};
use crate::node::{Mode, NodeEntry};
use crate::pubsub::Topic;
use crate::time::{MonotonicTime, WallTime};
use std::sync::atomic::Ordering;
use std::time::Duration;

/// Motion is inhibited.
pub(super) const DISARMED: &str = "disarmed";
/// Armed, and no command runs.
pub(super) const IDLE: &str = "idle";
/// Armed, and a command runs.
pub(super) const EXECUTING: &str = "executing";

/// The parts of the operational state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Machine {
    pub(super) safety: Safety,
    /// The state while no command runs.
    pub(super) resting: &'static str,
    /// Number of running commands.
    pub(super) running: usize,
}

impl Default for Machine {
    fn default() -> Self {
        Self { safety: Safety::Disarmed, resting: IDLE, running: 0 }
    }
}

impl Machine {
    /// Returns the name of the state.
    pub(super) fn state(&self) -> &'static str {
        match self.safety {
            Safety::Armed if self.running > 0 && self.resting == IDLE => EXECUTING,
            Safety::Armed => self.resting,
            Safety::Disarmed | Safety::Disarming | Safety::Error => DISARMED,
        }
    }
}

/// The processing of one entry: the lock, the entry's time, and the effects once the lock is released. No user code
/// may be called while it lives.
pub(super) struct Step<'a> {
    pub(super) control: &'a Control,
    pub(super) state: StateGuard<'a>,
    pub(super) now: MonotonicTime,
    wall_offset_nanos: i64,
    before: Machine,
    /// The caller whose request changes the safety state.
    pub(super) asked_by: Option<String>,
    pub(super) effects: Effects,
}

impl Control {
    /// Enters the control state.
    pub(super) fn step(&self) -> Step<'_> {
        self.step_in(self.lock())
    }

    /// Enters it once `holds`, or after `longest`.
    pub(super) fn step_once(&self, longest: Duration, holds: impl Fn(&State) -> bool) -> Step<'_> {
        self.step_in(self.locked_once(longest, &holds).0)
    }

    fn step_in<'a>(&'a self, state: StateGuard<'a>) -> Step<'a> {
        // Read under the lock, so that lines are in the order of their times.
        let now = self.0.clock.now();
        let wall_offset_nanos = self.0.clock.wall_offset_nanos();
        let before = state.machine;
        Step { control: self, state, now, wall_offset_nanos, before, asked_by: None, effects: Effects::default() }
    }
}

impl Step<'_> {
    /// Writes the entry's line. Returns its number, or 0 without a journal.
    pub(super) fn line(&self, event: Event) -> u64 {
        match &self.control.0.journal {
            Some(_) if self.state.has_ended => 0,
            Some(journal) => journal.write(self.now, self.wall_offset_nanos, event),
            None => 0,
        }
    }

    /// Publishes on a system topic; subscribers are woken once the lock is released.
    pub(super) fn publish<T: Payload>(&mut self, topic: &Topic<T>, payload: T, time: MonotonicTime) {
        if self.state.has_ended {
            return;
        }
        let wall_time = WallTime::from_unix_nanos(time.as_nanos().saturating_add(self.wall_offset_nanos));
        let origin = self.control.0.origin;
        let stamp = Stamp { monotonic_time: time, wall_time, origin, ..Stamp::default() };
        topic.publish_deferred(&stamp.message(payload), &mut self.effects.wakers);
    }

    /// Publishes changes of safety and state since the step began or since the last call.
    pub(super) fn publish_machine(&mut self, command: Option<&'static str>) {
        let before = std::mem::replace(&mut self.before, self.state.machine);
        let after = self.state.machine;
        let topics = &self.control.0.topics;
        if before.safety != after.safety {
            self.control.0.safety.store(after.safety as u8, Ordering::SeqCst);
            let (from, to) = (before.safety, after.safety);
            self.effects.log(Log::Safety { from, to });
            let caller = self.asked_by.clone();
            self.publish(&topics.safety, SafetyTransition { from, to, caller }, self.now);
        }
        if before.state() != after.state() {
            let (from, to) = (before.state(), after.state());
            self.effects.log(Log::State { from, to, command });
            self.publish(&topics.state, StateTransition { from, to, command }, self.now);
        }
    }

    pub(super) fn publish_safety_error(&mut self, error: SafetyError) {
        self.effects.log(Log::SafetyError(error.clone()));
        self.control.keep_safety_error(error.clone(), self.now);
        self.publish(&self.control.0.topics.safety_error, error, self.now);
    }

    /// Records a fault, see [`Control::note_fault`].
    pub(super) fn note_fault(&mut self, path: &'static str, message: String) {
        self.line(Event::Noted { path, message: message.clone() });
        self.publish_fault(path, message);
    }

    /// Records and publishes a component's failure.
    pub(super) fn publish_fault(&mut self, path: &'static str, message: String) {
        let fault = ComponentFault { path, message };
        self.control.keep_fault(fault.clone(), self.now);
        self.effects.log(Log::Fault(fault.clone()));
        self.publish(&self.control.0.topics.fault, fault, self.now);
    }

    /// Adds an entry for an estimator. In a replay, it is in the journal.
    pub(super) fn post(&mut self, estimator: usize, entry: NodeEntry) {
        if self.control.0.mode != Mode::Replay
            && let Some(islands) = self.control.0.islands.get()
        {
            self.effects.wired.extend(islands.post(estimator, self.now, entry));
        }
    }

    /// Releases the lock and runs the effects.
    pub(super) fn finish(mut self) {
        self.publish_machine(None);
        let Self { control, state, mut effects, .. } = self;
        effects.queue_lines(control);
        drop(state);
        control.0.changed.notify_all();
        effects.run(control);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn idle_becomes_executing_while_commands_run_and_a_declared_state_stays() {
        let mut machine = Machine::default();
        assert_eq!(machine.state(), "disarmed");
        machine.running = 1;
        assert_eq!(machine.state(), "disarmed", "the command that arms runs while it is disarmed");
        machine.safety = Safety::Armed;
        assert_eq!(machine.state(), "executing");
        machine = Machine { running: 0, resting: "degraded", ..machine };
        assert_eq!(machine.state(), "degraded");
        machine.running = 1;
        assert_eq!(machine.state(), "degraded", "a declared state is never hidden");
    }
}
