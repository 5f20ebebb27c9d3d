//! Disarm callbacks: what makes hardware safe.

use crate::component::DisarmHook;
use crate::event::SafetyError;
use crate::fault::{Fault, caught};
use std::cell::Cell;

/// The callbacks of all components, in the order in which they were registered.
#[derive(Default)]
pub(super) struct Hooks {
    all: Vec<Hook>,
    next: u64,
}

struct Hook {
    path: &'static str,
    number: u64,
    /// It stays when the component is restarted.
    is_kept: bool,
    /// The execution of a command that it ends with.
    execution: Option<u64>,
    /// It is of an `init` that failed, and failed itself.
    is_leftover: bool,
    run: DisarmHook,
}

impl Hooks {
    /// Of a component; `is_kept` if a restart does not replace it.
    pub(super) fn add(&mut self, path: &'static str, run: DisarmHook, is_kept: bool) {
        self.push(Hook { path, number: self.next, is_kept, execution: None, is_leftover: false, run });
    }

    /// Of an execution of a command.
    pub(super) fn add_of_execution(&mut self, path: &'static str, execution: u64, run: DisarmHook) {
        let execution = Some(execution);
        self.push(Hook { path, number: self.next, is_kept: false, execution, is_leftover: false, run });
    }

    /// Of an `init` that failed; those of earlier ones are taken out, to be dropped without a lock.
    pub(super) fn replace_leftovers(&mut self, path: &'static str, left: Vec<DisarmHook>) -> Vec<DisarmHook> {
        let earlier = self.all.extract_if(.., |hook| hook.path == path && hook.is_leftover);
        let earlier = earlier.map(|hook| hook.run).collect();
        for run in left {
            self.push(Hook { path, number: self.next, is_kept: false, execution: None, is_leftover: true, run });
        }
        earlier
    }

    fn push(&mut self, hook: Hook) {
        self.all.push(hook);
        self.next += 1;
    }

    /// What is registered from now on has a number from this one on.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// Whether the component at `path` has registered any from `number` on.
    pub(super) fn any_since(&self, path: &str, number: u64) -> bool {
        self.all.iter().any(|hook| hook.path == path && hook.number >= number)
    }

    /// Those that the component at `path` has registered from `number` on.
    pub(super) fn all_since(&self, path: &str, number: u64) -> Vec<DisarmHook> {
        let since = self.all.iter().filter(|hook| hook.path == path && hook.number >= number);
        since.map(|hook| DisarmHook::clone(&hook.run)).collect()
    }

    /// Takes those of a component out that were registered before `number`, or since; to be dropped without a lock.
    pub(super) fn take(&mut self, path: &str, number: u64, before: bool) -> Vec<DisarmHook> {
        let taken =
            self.all.extract_if(.., |hook| hook.path == path && !hook.is_kept && (hook.number < number) == before);
        taken.map(|hook| hook.run).collect()
    }

    /// Takes out those of an execution; to be dropped without a lock.
    pub(super) fn take_of_execution(&mut self, execution: u64) -> Vec<DisarmHook> {
        self.all.extract_if(.., |hook| hook.execution == Some(execution)).map(|hook| hook.run).collect()
    }

    /// Takes out all; to be dropped without a lock.
    pub(super) fn take_all(&mut self) -> Vec<(&'static str, DisarmHook)> {
        self.all.drain(..).map(|hook| (hook.path, hook.run)).collect()
    }

    pub(super) fn all(&self) -> Vec<(&'static str, DisarmHook)> {
        self.all.iter().map(|hook| (hook.path, DisarmHook::clone(&hook.run))).collect()
    }
}

thread_local! {
    /// Of which robot the calling thread runs a disarm callback, which must not wait for the disarming that it is a part of; 0
    /// for none.
    static INSIDE: Cell<usize> = const { Cell::new(0) };
}

pub(super) fn is_inside(robot: usize) -> bool {
    INSIDE.get() == robot
}

thread_local! {
    /// Of which robot the calling thread runs an actuator's code, which its disarm callback waits for; 0 for none.
    static IN_ACTUATOR: Cell<usize> = const { Cell::new(0) };
}

/// Whether the calling thread runs code that disarming waits for, so that it must not wait for that.
pub(super) fn is_waited_for(robot: usize) -> bool {
    is_inside(robot) || IN_ACTUATOR.get() == robot
}

/// The calling thread runs an actuator's code as long as this lives.
pub(crate) struct InActuator {
    before: usize,
}

impl InActuator {
    pub(super) fn new(robot: usize) -> Self {
        Self { before: IN_ACTUATOR.replace(robot) }
    }
}

impl Drop for InActuator {
    fn drop(&mut self) {
        IN_ACTUATOR.set(self.before);
    }
}

/// Runs a disarm callback on the calling thread; what went wrong.
pub(super) fn run(robot: usize, path: &'static str, hook: &DisarmHook) -> Option<SafetyError> {
    let before = INSIDE.replace(robot);
    let failed: Option<Fault> = caught(|| hook()).err().map(|failed| failed.fault);
    INSIDE.set(before);
    failed.map(|fault| SafetyError { path, message: format!("disarming failed: {fault}") })
}
