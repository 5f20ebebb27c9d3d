//! Disarm callbacks that run outside of a disarming: those of an `init` that failed, and those of code that may have
//! started hardware after the robot was disarmed.
//!
//! They stay registered while they run, so a disarming that begins meanwhile also runs them and waits for them.

use super::arming::{DISARM_WITHIN, late_at};
use super::callback::{Callback, Reason};
use super::hooks::Owner;
use super::inside;
use super::step::Step;
use super::{Control, Key, Limit, RunningCommand, State};
use crate::component::{DisarmHook, Guardian};
use crate::event::{Safety, SafetyError};
use crate::fault::{Failed, Fault, discard};
use crate::journal::Event;
use crate::node::Mode;
use std::sync::Arc;
use std::time::Duration;

/// Callbacks that run together.
pub(super) struct Apart {
    key: Key,
    path: &'static str,
    why: Why,
    /// The numbers of those that have not returned.
    left: Vec<u64>,
}

/// Why callbacks run; this determines the consequences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Why {
    /// An `init` has failed: an unplugged device is not dangerous. Each callback that succeeds is forgotten; one that
    /// fails is a fault, and stays for the next disarming.
    FailedInit,
    /// Hardware may have been started on a disarmed robot: a callback that fails is a hardware error.
    Started,
    /// The same by a cancelled command, which is gone once they have returned.
    Lingered(u64),
}

impl Apart {
    fn is_of_start(&self) -> bool {
        matches!(self.why, Why::Started | Why::FailedInit)
    }
}

impl State {
    /// Whether a callback still has to run for `key`.
    pub(super) fn is_apart(&self, key: Key, number: u64) -> bool {
        self.apart.iter().any(|apart| apart.key == key && apart.left.contains(&number))
    }

    /// Whether hardware that an `init` or a `handle_options` has started is still being made safe.
    pub(super) fn is_making_safe(&self) -> bool {
        self.apart.iter().any(Apart::is_of_start)
    }

    /// The paths of the components of which this is true.
    pub(super) fn being_made_safe(&self) -> Vec<&'static str> {
        self.apart.iter().filter(|apart| apart.is_of_start()).map(|apart| apart.path).collect()
    }

    /// The paths of components whose callbacks run.
    pub(super) fn apart_paths(&self) -> impl Iterator<Item = &'static str> {
        self.apart.iter().map(|apart| apart.path)
    }
}

impl Control {
    /// Registers an actuator's own `disarm`, which restarts do not replace.
    pub(crate) fn on_disarm_always(&self, path: &'static str, code: DisarmHook) {
        self.register(path, Owner::Actuator, code);
    }

    /// Registers a callback that makes hardware safe. While the robot is being disarmed, it is run as well. After the
    /// last disarming, it is run at once.
    fn register(&self, path: &'static str, owner: Owner, code: DisarmHook) {
        let mut step = self.step();
        let is_known = match owner {
            Owner::Execution(id) => step.state.executions.iter().any(|execution| execution.id == id),
            _ => true,
        };
        let is_callback = inside::is_callback(self.id());
        if is_callback && (step.state.has_ended || step.state.is_stopped()) {
            // A callback registered by a callback runs at the next disarming, but there is none after this.
            step.finish();
            return discard(code);
        }
        if step.state.has_ended || !is_known {
            let callback = step.state.hooks.make(path, code);
            if !is_known && !step.state.has_ended {
                let message = "it registered a disarm callback when it had ended; that was run at once";
                step.note_fault(path, message.to_owned());
            }
            let key = step.run_apart(path, vec![callback], Why::Started);
            step.finish();
            return self.wait_apart(key);
        }
        let callback = step.state.hooks.add(path, code, owner);
        let mut key = None;
        if step.state.is_stopped() {
            key = step.run_apart(path, vec![callback], Why::Started);
        } else if !is_callback {
            // A callback registered by a callback runs at the next disarming.
            step.join_disarming(vec![callback]);
        }
        step.lingers_on(owner);
        step.finish();
        self.wait_apart(key);
    }

    /// Runs `make`, which creates the component at `path` or changes its options. Once it has succeeded, the
    /// callbacks it registered replace earlier ones. The hardware has a callback at all times.
    ///
    /// The next attempt waits until the callbacks of the previous one have returned, since they still hold the
    /// device.
    pub(crate) fn replacing_hooks<T>(
        &self,
        path: &'static str,
        is_made: bool,
        make: impl FnOnce() -> Result<T, Failed>,
    ) -> Result<T, Failed> {
        let (first, disarmings) = {
            let state = self.lock();
            if state.hooks.hang(path) {
                return Err(Fault::new("a disarm callback of its last attempt to start has not returned").into());
            }
            (state.hooks.next(), state.ended_disarmings())
        };
        let made = make();
        let mut step = self.step();
        let hooks = &mut step.state.hooks;
        let (callbacks, old) = match made {
            Ok(_) if is_made => hooks.made(path, first),
            Ok(_) => hooks.changed(path, first),
            Err(_) => hooks.failed(path, first),
        };
        let key = match made {
            Ok(_) => step.run_again(path, callbacks, disarmings),
            Err(_) => step.run_apart(path, callbacks, Why::FailedInit),
        };
        step.finish();
        self.wait_apart(key);
        old.into_iter().for_each(discard);
        made
    }

    /// Waits until the callbacks have returned or have timed out, or until a disarming begins, which runs them too
    /// and may have to wait for the caller.
    fn wait_apart(&self, key: Option<Key>) {
        let Some(key) = key else { return };
        // A robot that does not start is disarmed next.
        if self.0.mode != Mode::Real || cfg!(loom) || !self.lock().has_begun {
            return;
        }
        // The callback of an actuator waits for the code that this call is part of.
        let Some(_waits) = inside::waits_for(self.id()) else { return };
        let is_over = |state: &State| state.apart.iter().all(|apart| apart.key != key) || state.disarming.is_some();
        if !self.wait_until(DISARM_WITHIN + Duration::from_millis(500), is_over) {
            // The timekeeper's thread is gone.
            self.apart_timeout(key);
        }
    }

    /// Whether callbacks run outside of a disarming.
    #[cfg(loom)]
    pub(super) fn makes_safe(&self) -> bool {
        !self.lock().apart.is_empty()
    }

    /// Runs each callback on a thread of its own, and returns those for which no thread could be started. On virtual time it
    /// returns all of them, and the caller runs them.
    pub(super) fn start_apart(&self, key: Key, callbacks: Vec<Arc<Callback>>) -> Vec<Arc<Callback>> {
        if self.0.mode != Mode::Real || cfg!(loom) {
            return callbacks;
        }
        callbacks.into_iter().filter(|callback| !callback.start(self, Reason::Apart(key))).collect()
    }

    /// A callback that ran outside of a disarming has returned.
    pub(super) fn apart_returned(&self, key: Key, number: u64, error: Option<SafetyError>) {
        let mut step = self.step();
        let Some(apart) = step.state.apart.iter_mut().find(|apart| apart.key == key) else { return };
        let before = apart.left.len();
        apart.left.retain(|other| *other != number);
        if apart.left.len() == before {
            return;
        }
        let (why, is_last) = (apart.why, apart.left.is_empty());
        let mut safe = Vec::new();
        match error {
            None if why == Why::FailedInit => safe = step.state.hooks.take_one(number),
            None => {}
            Some(error) => step.was_not_safe(why, error),
        }
        if is_last {
            step.end_apart(key);
        }
        step.finish();
        safe.into_iter().for_each(discard);
    }

    /// Callbacks that run outside of a disarming have timed out.
    pub(super) fn apart_timeout(&self, key: Key) {
        let mut step = self.step();
        let Some(apart) = step.state.apart.iter_mut().find(|apart| apart.key == key) else { return };
        let (path, why) = (apart.path, apart.why);
        for _ in std::mem::take(&mut apart.left) {
            step.was_not_safe(why, late_at(path));
        }
        step.end_apart(key);
        step.finish();
    }
}

impl Step<'_> {
    /// If the robot was disarmed while a component was created or its options changed, its callbacks may have run
    /// before its hardware was started, so they run once more.
    fn run_again(&mut self, path: &'static str, callbacks: Vec<Arc<Callback>>, disarmings: u64) -> Option<Key> {
        let has_begun = self.state.generation != disarmings;
        let was_disarmed = has_begun && self.state.machine.safety != Safety::Armed;
        if !was_disarmed && !self.state.is_stopped() {
            return None;
        }
        let left = self.join_disarming(callbacks);
        self.run_apart(path, left, Why::Started)
    }

    /// The code of a cancelled command has returned. It may have started hardware after its callbacks had run, so
    /// they run once more before it is gone. Returns true if there are any.
    pub(super) fn makes_safe_after(&mut self, id: u64) -> bool {
        let lingers_on = |execution: &RunningCommand| execution.id == id && execution.lingers_on;
        if self.state.machine.safety == Safety::Armed || !self.state.executions.iter().any(lingers_on) {
            return false;
        }
        let callbacks = self.state.hooks.of_execution(id);
        let path = callbacks.first().map_or("", |callback| callback.path);
        self.run_apart(path, callbacks, Why::Lingered(id)).is_some()
    }

    /// A command registers a callback. If the robot is not armed, the command's code has continued after the disarming.
    fn lingers_on(&mut self, owner: Owner) {
        let Owner::Execution(id) = owner else { return };
        if self.state.machine.safety == Safety::Armed {
            return;
        }
        if let Some(execution) = self.state.executions.iter_mut().find(|execution| execution.id == id) {
            execution.lingers_on = true;
        }
    }

    /// Adds callbacks to the disarming in progress; returns them if there is no disarming.
    fn join_disarming(&mut self, callbacks: Vec<Arc<Callback>>) -> Vec<Arc<Callback>> {
        let Some(disarming) = &mut self.state.disarming else { return callbacks };
        disarming.left.extend(callbacks.iter().map(|callback| (callback.number, callback.path)));
        if !callbacks.is_empty() {
            self.effects.hooks.push((disarming.generation, callbacks));
        }
        Vec::new()
    }

    fn run_apart(&mut self, path: &'static str, callbacks: Vec<Arc<Callback>>, why: Why) -> Option<Key> {
        if callbacks.is_empty() {
            return None;
        }
        let key = Key(self.state.next_apart);
        self.state.next_apart += 1;
        let left = callbacks.iter().map(|callback| callback.number).collect();
        self.state.apart.push(Apart { key, path, why, left });
        if self.control.0.mode == Mode::Real {
            self.control.0.limits.set(Limit::Apart(key), self.now + DISARM_WITHIN);
        }
        self.effects.apart.push((key, callbacks));
        Some(key)
    }

    fn was_not_safe(&mut self, why: Why, error: SafetyError) {
        let SafetyError { path, message } = error;
        match why {
            Why::FailedInit => self.note_fault(path, message),
            Why::Started | Why::Lingered(_) => {
                self.line(Event::HardwareError { path, message: message.clone() });
                self.hardware_error(SafetyError { path, message });
            }
        }
    }

    fn end_apart(&mut self, key: Key) {
        let Some(index) = self.state.apart.iter().position(|apart| apart.key == key) else { return };
        let apart = self.state.apart.swap_remove(index);
        self.control.0.limits.clear(Limit::Apart(key));
        if let Why::Lingered(id) = apart.why {
            self.gone(id);
        }
        if !self.state.is_making_safe() {
            for id in std::mem::take(&mut self.state.held_gone) {
                self.gone(id);
            }
            self.effects.ended.append(&mut self.state.held);
        }
    }
}

/// In a replay, the journal contains the components' reports, and there is no hardware.
impl Guardian for Control {
    fn on_disarm(&self, path: &'static str, execution: Option<u64>, hook: DisarmHook) {
        match self.0.mode {
            Mode::Replay => discard(hook),
            Mode::Real | Mode::Virtual => {
                self.register(path, execution.map_or(Owner::Component, Owner::Execution), hook);
            }
        }
    }

    fn hardware_error(&self, path: &'static str, message: String) {
        if self.0.mode != Mode::Replay {
            self.note_hardware_error(path, message);
        }
    }
}
