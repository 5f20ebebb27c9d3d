//! Disarm callbacks: what makes hardware safe, and whose they are.

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

/// When a callback is forgotten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// Never: it is the actuator's own.
    Actuator,
    /// When the component is made again.
    Component,
    /// When the component is made again, or its options change and that registers callbacks.
    Options,
    /// When the code of that execution of a command has returned.
    Execution(u64),
    /// The `init` that registered it has failed. It is forgotten when it has made safe what that had started.
    FailedInit,
}

impl Hooks {
    pub(super) fn add(&mut self, path: &'static str, run: DisarmHook, owner: Owner) -> Arc<Callback> {
        let callback = self.make(path, run);
        self.all.push(Hook { callback: Arc::clone(&callback), owner });
        callback
    }

    /// One that is not kept.
    pub(super) fn make(&mut self, path: &'static str, run: DisarmHook) -> Arc<Callback> {
        let number = self.next;
        self.next += 1;
        Arc::new(Callback::new(number, path, run))
    }

    /// What is registered from now on has a number from this one on.
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

    /// The component at `path` was made, and those from `first` on are new. All it has now, and the ones that are replaced,
    /// which are to be dropped without a lock.
    pub(super) fn made(&mut self, path: &str, first: u64) -> (Vec<Arc<Callback>>, Vec<Arc<Callback>>) {
        let old = self.take(|hook| {
            let is_replaced = matches!(hook.owner, Owner::Component | Owner::Options | Owner::FailedInit);
            is_replaced && hook.is_of(path) && hook.callback.number < first
        });
        (self.of_component(path), old)
    }

    /// The same of a component whose options have changed. What it registered when it was made is kept: a callback too many
    /// fails loudly, and one too few does so when something burns.
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

    /// The component at `path` could not be made. What it had registered from `first` on, and the ones of earlier failures,
    /// which are to be dropped without a lock.
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

    /// Whether what an `init` of the component at `path` registered that failed then has not returned.
    pub(super) fn hang(&self, path: &str) -> bool {
        let mut failed = self.all.iter().filter(|hook| hook.is_of(path) && hook.owner == Owner::FailedInit);
        failed.any(|hook| hook.callback.is_running())
    }

    /// Those of the component at `path`, an actuator's own among them.
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

    /// Takes out the one of that number; to be dropped without a lock.
    pub(super) fn take_one(&mut self, number: u64) -> Vec<Arc<Callback>> {
        self.take(|hook| hook.callback.number == number)
    }

    /// Takes out those of an execution; to be dropped without a lock.
    pub(super) fn take_of_execution(&mut self, execution: u64) -> Vec<Arc<Callback>> {
        self.take(|hook| hook.owner == Owner::Execution(execution))
    }

    /// Takes out those of a component that is given up; to be dropped without a lock.
    pub(super) fn take_failed(&mut self, path: &str) -> Vec<Arc<Callback>> {
        self.take(|hook| hook.is_of(path) && hook.owner == Owner::FailedInit)
    }

    /// Takes out all but those of these executions; to be dropped without a lock.
    pub(super) fn take_but_of(&mut self, executions: &[u64]) -> Vec<Arc<Callback>> {
        self.take(|hook| !matches!(hook.owner, Owner::Execution(id) if executions.contains(&id)))
    }
}

impl Hook {
    fn is_of(&self, path: &str) -> bool {
        self.callback.path == path
    }
}
