//! Registering disarm callbacks, and running those of one component outside of a disarming.
//!
//! - The hardware of a component has a callback at all times: a component that is created again, or takes new options, keeps its earlier
//!   callbacks until that has succeeded.
//! - Callbacks of an `init` that has failed run at once, and so do those of an `init` or a `handle_options` during which the robot was
//!   disarmed: they may have run before the hardware was started. They stay registered meanwhile, so a disarming that begins then runs
//!   them and waits for them too.
//! - They may take [`DISARM_WITHIN`]. Until they have returned, the robot is not armed, and the component is not started again.

use super::arming::{DISARM_WITHIN, late_at};
use super::callbacks::{Apart, Callback, Forgotten, Owner, Reason, is_awaited};
use super::step::Step;
use super::{Control, Key, Limit, State};
use crate::component::{DisarmHook, Guardian};
use crate::event::{HardwareError, Safety, SafetyError};
use crate::fault::{Failed, Fault, Place, discard, is_inside};
use crate::journal::Event;
use crate::node::Mode;
use crate::schedule::Reserved;
use std::sync::Arc;
use std::time::Duration;

impl Control {
    /// Registers an actuator's own `disarm`, which restarts do not replace.
    pub(crate) fn on_disarm_always(&self, path: &'static str, code: DisarmHook) {
        self.register(path, Owner::Actuator, code);
    }

    /// Registers a callback. While the robot is being disarmed, it is run as well; after the last disarming, at once. One of a command
    /// whose code has returned is dropped.
    fn register(&self, path: &'static str, owner: Owner, code: DisarmHook) {
        let place = self.place_for(path, owner);
        let mut step = self.step();
        let is_known = match owner {
            Owner::Execution(id) => step.state.executions.iter().any(|execution| execution.id == id),
            _ => true,
        };
        // A callback that registers another: that one runs at the next disarming.
        let is_callback = is_inside(Place::Callback(self.id()));
        let is_last = step.state.is_stopped();
        if !is_known || is_callback && is_last {
            step.finish();
            return discard(code);
        }
        // After the end, nothing is kept: it would keep the robot alive.
        let callback = step.state.hooks.make(path, code, place);
        if !step.state.has_ended {
            step.state.hooks.add(Arc::clone(&callback), owner);
        }
        let mut key = None;
        if is_last {
            key = step.run_apart(path, vec![callback], false);
        } else if !is_callback {
            step.join_disarming(vec![callback]);
        }
        step.finish();
        self.wait_apart(key);
    }

    /// Reserves a thread for a callback of a component, so that it never waits for others. Callbacks of commands, whose number is not
    /// bounded, get threads when they run.
    fn place_for(&self, path: &'static str, owner: Owner) -> Option<Reserved> {
        if self.0.mode != Mode::Real || matches!(owner, Owner::Execution(_)) {
            return None;
        }
        match self.0.reserve.place() {
            Ok(place) => Some(place),
            Err(error) => {
                self.note_fault(path, format!("its disarm callback has no thread of its own: {error}"));
                None
            }
        }
    }

    /// Keeps a thread for the callbacks of commands, until the result is dropped. The error names the component without a thread for
    /// its own.
    pub(crate) fn start_reserve(&self) -> Result<Reserved, (&'static str, Fault)> {
        let place = self.0.spare.place().map_err(|error| ("disarm", error.into()))?;
        let without = self.lock().hooks.without_thread();
        without
            .map_or(Ok(place), |path| Err((path, Fault::new("no thread can be started for its disarm callback"))))
    }

    /// Runs `make`, which creates the component at `path` or changes its options. Once it has succeeded, the callbacks it registered
    /// replace earlier ones; if it fails, they run. The hardware has a callback at all times.
    ///
    /// The next attempt waits until the callbacks of the previous one have returned, since they still hold the device.
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
            (state.hooks.next, state.ended_disarmings())
        };
        let made = make();
        let old = self.settle_hooks(path, first, disarmings, made.is_ok(), is_made);
        old.into_iter().for_each(discard);
        made
    }

    fn settle_hooks(
        &self,
        path: &'static str,
        first: u64,
        disarmings: u64,
        is_ok: bool,
        is_made: bool,
    ) -> Forgotten {
        let mut step = self.step();
        let (key, old) = if is_ok {
            let (callbacks, old) = step.state.hooks.succeeded(path, first, is_made);
            // If the robot was disarmed meanwhile, they may have run before the hardware was started.
            let was_disarmed = step.state.generation != disarmings && step.state.machine.safety != Safety::Armed;
            let again = if was_disarmed || step.state.is_stopped() { callbacks } else { Vec::new() };
            let left = step.join_disarming(again);
            (step.run_apart(path, left, false), old)
        } else {
            let (callbacks, old) = step.state.hooks.failed(path, first);
            (step.run_apart(path, callbacks, true), old)
        };
        step.finish();
        self.wait_apart(key);
        old
    }

    /// Waits until the callbacks have returned or have timed out, or until a disarming begins, which runs them too and may have to wait
    /// for the caller.
    fn wait_apart(&self, key: Option<Key>) {
        let Some(key) = key else { return };
        // A robot that does not start is disarmed next.
        if self.0.mode != Mode::Real || cfg!(loom) || !self.lock().has_begun || is_awaited(self.id()) {
            return;
        }
        let is_over = |state: &State| state.apart.iter().all(|apart| apart.key != key) || state.disarming.is_some();
        if !self.wait_until(DISARM_WITHIN + Duration::from_millis(500), is_over) {
            // The timekeeper's thread is gone.
            self.apart_timeout(key);
        }
    }

    /// Returns whether callbacks run outside of a disarming.
    #[cfg(loom)]
    pub(super) fn makes_safe(&self) -> bool {
        !self.lock().apart.is_empty()
    }

    /// Notes that a callback which ran outside of a disarming has returned.
    pub(super) fn apart_returned(&self, key: Key, number: u64, error: Option<SafetyError>) {
        let mut step = self.step();
        let Some(apart) = step.state.apart.iter_mut().find(|apart| apart.key == key) else { return };
        let Some(index) = apart.left.iter().position(|other| *other == number) else { return };
        apart.left.swap_remove(index);
        let (is_failed_init, is_last) = (apart.is_failed_init, apart.left.is_empty());
        match error {
            None if is_failed_init => {
                let safe = step.state.hooks.take_one(number);
                step.forget(safe);
            }
            None => {}
            Some(error) => step.was_not_safe(is_failed_init, error),
        }
        if is_last {
            step.end_apart(key);
        }
        step.finish();
    }

    /// Notes that callbacks which run outside of a disarming have timed out.
    pub(super) fn apart_timeout(&self, key: Key) {
        let mut step = self.step();
        let Some(apart) = step.state.apart.iter_mut().find(|apart| apart.key == key) else { return };
        let (path, is_failed_init) = (apart.path, apart.is_failed_init);
        for _ in std::mem::take(&mut apart.left) {
            step.was_not_safe(is_failed_init, late_at(path));
        }
        step.end_apart(key);
        step.finish();
    }
}

impl Step<'_> {
    /// Adds callbacks to the disarming in progress; returns them if there is no disarming.
    fn join_disarming(&mut self, callbacks: Vec<Arc<Callback>>) -> Vec<Arc<Callback>> {
        let Some(disarming) = &mut self.state.disarming else { return callbacks };
        disarming.left.extend(callbacks.iter().map(|callback| (callback.number, callback.path)));
        if !callbacks.is_empty() {
            self.effects.callbacks.push((Reason::Disarming(disarming.generation), callbacks));
        }
        Vec::new()
    }

    fn run_apart(
        &mut self,
        path: &'static str,
        callbacks: Vec<Arc<Callback>>,
        is_failed_init: bool,
    ) -> Option<Key> {
        if callbacks.is_empty() {
            return None;
        }
        let key = Key(self.state.next_apart);
        self.state.next_apart += 1;
        let left = callbacks.iter().map(|callback| callback.number).collect();
        self.state.apart.push(Apart { key, path, is_failed_init, left });
        if self.control.0.mode == Mode::Real {
            self.control.0.limits.set(Limit::Apart(key), self.now + DISARM_WITHIN);
        }
        self.effects.callbacks.push((Reason::Apart(key), callbacks));
        Some(key)
    }

    fn was_not_safe(&mut self, is_failed_init: bool, SafetyError { path, error }: SafetyError) {
        if is_failed_init {
            return self.note_fault(path, error.message);
        }
        self.line(Event::HardwareError { path, error: error.clone() });
        self.hardware_error(SafetyError { path, error });
    }

    fn end_apart(&mut self, key: Key) {
        self.state.apart.retain(|apart| apart.key != key);
        self.control.0.limits.clear(Limit::Apart(key));
        if self.state.apart.is_empty() {
            for id in std::mem::take(&mut self.state.held_lingering) {
                self.forget_lingering(id);
            }
            self.effects.ended.append(&mut self.state.held);
        }
    }

    /// Drops callbacks once the lock is released.
    pub(super) fn forget(&mut self, callbacks: Forgotten) {
        self.effects.dropped.extend(callbacks.into_iter().map(|callback| Box::new(callback) as _));
    }
}

/// The guardian of components. In a replay, the journal contains their reports, and there is no hardware.
impl Guardian for Control {
    fn on_disarm(&self, path: &'static str, execution: Option<u64>, hook: DisarmHook) {
        match self.0.mode {
            Mode::Replay => discard(hook),
            Mode::Real | Mode::Virtual => {
                self.register(path, execution.map_or(Owner::Component, Owner::Execution), hook);
            }
        }
    }

    fn hardware_error(&self, path: &'static str, error: HardwareError) {
        if self.0.mode != Mode::Replay {
            self.note_hardware_error(path, error);
        }
    }
}
