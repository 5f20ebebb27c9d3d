//! Disarm callbacks, which make hardware safe, and their owners.

use super::callback::Callback;
use crate::component::DisarmHook;
use std::sync::Arc;

/// The callbacks of all components, in the order in which they were registered.
#[derive(Default)]
pub(super) struct Hooks {
    all: Vec<Hook>,
    next: u64,
}

struct Hook {
    callback: Arc<Callback>,
    owner: Owner,
}

/// The lifetime of a callback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// Never forgotten: it is the actuator's own.
    Actuator,
    /// Forgotten when the component is created again.
    Component,
    /// Forgotten when the component is created again, or when a change of its options registers callbacks.
    Options,
    /// Forgotten when the code of that command execution has returned.
    Execution(u64),
    /// The `init` that registered it has failed. It is forgotten once it has made safe what that `init` had started.
    FailedInit,
}

impl Hooks {
    pub(super) fn add(&mut self, path: &'static str, run: DisarmHook, owner: Owner) -> Arc<Callback> {
        let callback = self.make(path, run);
        self.all.push(Hook { callback: Arc::clone(&callback), owner });
        callback
    }

    /// Creates one that is not kept.
    pub(super) fn make(&mut self, path: &'static str, run: DisarmHook) -> Arc<Callback> {
        let number = self.next;
        self.next += 1;
        Arc::new(Callback::new(number, path, run))
    }

    /// Callbacks registered from now on have numbers from this one on.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    pub(super) fn all(&self) -> Vec<Arc<Callback>> {
        self.all.iter().map(|hook| Arc::clone(&hook.callback)).collect()
    }

    pub(super) fn of_execution(&self, execution: u64) -> Vec<Arc<Callback>> {
        let own = self.all.iter().filter(|hook| hook.owner == Owner::Execution(execution));
        own.map(|hook| Arc::clone(&hook.callback)).collect()
    }

    /// The component at `path` was created; callbacks from `first` on are new. Returns its current callbacks, and the
    /// replaced ones, which are to be dropped without a lock.
    pub(super) fn made(&mut self, path: &str, first: u64) -> (Vec<Arc<Callback>>, Vec<Arc<Callback>>) {
        let old = self.take(|hook| {
            let is_replaced = matches!(hook.owner, Owner::Component | Owner::Options | Owner::FailedInit);
            is_replaced && hook.is_of(path) && hook.callback.number < first
        });
        (self.of_component(path), old)
    }

    /// The same for a component whose options have changed. Its callbacks from its creation are kept: with one too
    /// many, the failure is loud; with one too few, it shows only when hardware burns.
    pub(super) fn changed(&mut self, path: &str, first: u64) -> (Vec<Arc<Callback>>, Vec<Arc<Callback>>) {
        let mut has_any = false;
        for hook in self.since(path, first) {
            hook.owner = Owner::Options;
            has_any = true;
        }
        let is_old = |hook: &Hook| hook.is_of(path) && hook.callback.number < first && hook.owner == Owner::Options;
        let old = if has_any { self.take(is_old) } else { Vec::new() };
        (self.of_component(path), old)
    }

    /// The component at `path` could not be created. Returns the callbacks it had registered from `first` on, and
    /// those of earlier failures, which are to be dropped without a lock.
    pub(super) fn failed(&mut self, path: &str, first: u64) -> (Vec<Arc<Callback>>, Vec<Arc<Callback>>) {
        let new: Vec<_> = self
            .since(path, first)
            .map(|hook| {
                hook.owner = Owner::FailedInit;
                Arc::clone(&hook.callback)
            })
            .collect();
        let is_old =
            |hook: &Hook| hook.is_of(path) && hook.callback.number < first && hook.owner == Owner::FailedInit;
        let old = if new.is_empty() { Vec::new() } else { self.take(is_old) };
        (new, old)
    }

    /// Whether the callback with that number is the own one of an actuator.
    pub(super) fn is_of_actuator(&self, number: u64) -> bool {
        self.all.iter().any(|hook| hook.callback.number == number && hook.owner == Owner::Actuator)
    }

    /// Whether callbacks of a failed `init` of the component at `path` have not returned.
    pub(super) fn hang(&self, path: &str) -> bool {
        let mut failed = self.all.iter().filter(|hook| hook.is_of(path) && hook.owner == Owner::FailedInit);
        failed.any(|hook| hook.callback.is_running())
    }

    /// The callbacks of the component at `path`, including an actuator's own.
    fn of_component(&self, path: &str) -> Vec<Arc<Callback>> {
        let is_own = |hook: &&Hook| matches!(hook.owner, Owner::Actuator | Owner::Component | Owner::Options);
        let own = self.all.iter().filter(|hook| hook.is_of(path)).filter(is_own);
        own.map(|hook| Arc::clone(&hook.callback)).collect()
    }

    fn since(&mut self, path: &str, first: u64) -> impl Iterator<Item = &mut Hook> {
        let of_component = |hook: &&mut Hook| matches!(hook.owner, Owner::Component | Owner::Options);
        self.all
            .iter_mut()
            .filter(of_component)
            .filter(move |hook| hook.is_of(path) && hook.callback.number >= first)
    }

    fn take(&mut self, fits: impl Fn(&Hook) -> bool) -> Vec<Arc<Callback>> {
        self.all.extract_if(.., |hook| fits(hook)).map(|hook| hook.callback).collect()
    }

    /// Removes the callback of that number; drop it without a lock.
    pub(super) fn take_one(&mut self, number: u64) -> Vec<Arc<Callback>> {
        self.take(|hook| hook.callback.number == number)
    }

    /// Removes those of an execution; drop them without a lock.
    pub(super) fn take_of_execution(&mut self, execution: u64) -> Vec<Arc<Callback>> {
        self.take(|hook| hook.owner == Owner::Execution(execution))
    }

    /// Removes those of a component that is given up; drop them without a lock.
    pub(super) fn take_failed(&mut self, path: &str) -> Vec<Arc<Callback>> {
        self.take(|hook| hook.is_of(path) && hook.owner == Owner::FailedInit)
    }

    /// Removes all but those of these executions; drop them without a lock.
    pub(super) fn take_but_of(&mut self, executions: &[u64]) -> Vec<Arc<Callback>> {
        self.take(|hook| !matches!(hook.owner, Owner::Execution(id) if executions.contains(&id)))
    }
}

impl Hook {
    fn is_of(&self, path: &str) -> bool {
        self.callback.path == path
    }
}
