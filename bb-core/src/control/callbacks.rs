//! Disarm callbacks, which make hardware safe: how each runs, and who owns it.
//!
//! - A callback is user code. It runs on a thread of the [`Reserve`](crate::schedule::Reserve) that nothing else uses meanwhile, and
//!   never on two at once: if it is asked for while it runs, that thread runs it once more. On virtual time it runs on the caller's
//!   thread.
//! - A disarming runs all of them: see [`arming`](super::arming). Some also run [`Apart`] from one: see
//!   [`registering`](super::registering).
//! - Code that a disarming waits for does not wait for that disarming: [`is_awaited`] tells the thread that runs it.

use super::{Control, Key, State};
use crate::component::DisarmHook;
use crate::event::{HardwareError, HardwareErrorKind, SafetyError};
use crate::fault::{Inside, Place, caught, lock, times_inside};
use crate::schedule::Reserved;
use std::sync::{Arc, Mutex};

/// One disarm callback.
pub(super) struct Callback {
    /// Number among all callbacks of the robot.
    pub(super) number: u64,
    /// The path of the component that registered it.
    pub(super) path: &'static str,
    code: DisarmHook,
    runs: Mutex<Runs>,
    /// Thread that is kept for it.
    place: Option<Reserved>,
}

#[derive(Default)]
struct Runs {
    is_running: bool,
    /// Reasons to run once more, collected while it runs.
    waiting: Vec<Reason>,
}

/// Reason for which a callback runs, and who waits for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reason {
    /// The disarming with that number.
    Disarming(u64),
    /// Outside of a disarming.
    Apart(Key),
}

impl Callback {
    /// Runs it on its own thread. One without takes none that another has.
    pub(super) fn start(self: &Arc<Self>, control: &Control, reason: Reason) {
        if self.begin(reason) {
            let (callback, robot) = (Arc::clone(self), control.clone());
            let threads = if self.place.is_some() { &control.0.reserve } else { &control.0.spare };
            threads.run(Box::new(move || callback.work(&robot, reason)));
        }
    }

    /// Runs it on the calling thread.
    pub(super) fn run(&self, control: &Control, reason: Reason) {
        if self.begin(reason) {
            self.work(control, reason);
        }
    }

    /// Returns true if the caller is to run it. If it runs already, that thread runs it once more.
    fn begin(&self, reason: Reason) -> bool {
        let mut runs = lock(&self.runs);
        let is_running = std::mem::replace(&mut runs.is_running, true);
        if is_running {
            runs.waiting.push(reason);
        }
        !is_running
    }

    fn work(&self, control: &Control, reason: Reason) {
        let mut reasons = vec![reason];
        while !reasons.is_empty() {
            let failed = {
                let _inside = Inside::new(Place::Callback(control.id()));
                caught(|| (self.code)()).err()
            };
            let error = failed.map(|failed| SafetyError {
                path: self.path,
                error: HardwareError::new(
                    HardwareErrorKind::NotMadeSafe,
                    format!("disarming failed: {}", failed.fault),
                ),
            });
            let next = self.wanted(control);
            for reason in std::mem::replace(&mut reasons, next) {
                match reason {
                    Reason::Disarming(generation) => {
                        control.hook_returned(generation, Some(self.number), error.clone())
                    }
                    Reason::Apart(key) => control.apart_returned(key, self.number, error.clone()),
                }
            }
        }
    }

    /// The reasons to run once more that somebody still waits for; once no reason is left, it is no longer running.
    fn wanted(&self, control: &Control) -> Vec<Reason> {
        loop {
            let mut runs = lock(&self.runs);
            let mut waiting = std::mem::take(&mut runs.waiting);
            if waiting.is_empty() {
                runs.is_running = false;
                return waiting;
            }
            drop(runs);
            let state = control.lock();
            waiting.retain(|reason| state.is_wanted(*reason, self.number));
            if !waiting.is_empty() {
                return waiting;
            }
        }
    }
}

/// The callbacks of all components, in the order in which they were registered.
#[derive(Default)]
pub(super) struct Hooks {
    all: Vec<Hook>,
    pub(super) next: u64,
}

struct Hook {
    callback: Arc<Callback>,
    owner: Owner,
}

/// The lifetime of a callback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// Kept until the robot's end: the callback is the actuator's own.
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

/// Callbacks that are to be dropped without the lock of the control state.
pub(super) type Forgotten = Vec<Arc<Callback>>;

impl Hooks {
    /// Creates one that is not kept.
    pub(super) fn make(&mut self, path: &'static str, code: DisarmHook, place: Option<Reserved>) -> Arc<Callback> {
        let number = self.next;
        self.next += 1;
        Arc::new(Callback { number, path, code, runs: Mutex::default(), place })
    }

    pub(super) fn add(&mut self, callback: Arc<Callback>, owner: Owner) {
        self.all.push(Hook { callback, owner });
    }

    /// All callbacks; those with a thread come first.
    pub(super) fn all(&self) -> Vec<Arc<Callback>> {
        let mut all = self.fitting(&|hook| hook.callback.place.is_some());
        all.extend(self.fitting(&|hook| hook.callback.place.is_none()));
        all
    }

    /// The path of a component whose callback has no thread.
    pub(super) fn without_thread(&self) -> Option<&'static str> {
        let is_without = |hook: &&Hook| hook.callback.place.is_none() && !matches!(hook.owner, Owner::Execution(_));
        self.all.iter().find(is_without).map(|hook| hook.callback.path)
    }

    /// The component at `path` was created, or has taken new options: callbacks from `first` on are new. Returns its current ones. A
    /// change of options that registers none keeps those of the previous change, and any keeps those of its creation: with one
    /// too many, the failure is loud; with one too few, it shows only when hardware burns.
    pub(super) fn succeeded(&mut self, path: &str, first: u64, is_made: bool) -> (Vec<Arc<Callback>>, Forgotten) {
        let has_new = self.give_new_to(path, first, if is_made { Owner::Component } else { Owner::Options });
        let old = self.take(&|hook| {
            let is_replaced = match hook.owner {
                Owner::Options => is_made || has_new,
                Owner::Component | Owner::FailedInit => is_made,
                Owner::Actuator | Owner::Execution(_) => false,
            };
            is_replaced && hook.callback.path == path && hook.callback.number < first
        });
        let is_own = |hook: &Hook| matches!(hook.owner, Owner::Actuator | Owner::Component | Owner::Options);
        (self.fitting(&|hook| hook.callback.path == path && is_own(hook)), old)
    }

    /// The component at `path` could not be created. Returns the callbacks it had registered from `first` on; they replace those of
    /// earlier failures.
    pub(super) fn failed(&mut self, path: &str, first: u64) -> (Vec<Arc<Callback>>, Forgotten) {
        let has_new = self.give_new_to(path, first, Owner::FailedInit);
        let of_failed = |hook: &Hook| hook.callback.path == path && hook.owner == Owner::FailedInit;
        let old = self.take(&|hook| has_new && of_failed(hook) && hook.callback.number < first);
        (self.fitting(&|hook| of_failed(hook) && hook.callback.number >= first), old)
    }

    /// Sets the owner of those that the component has registered from `first` on. Returns whether there are any.
    fn give_new_to(&mut self, path: &str, first: u64, owner: Owner) -> bool {
        let mut has_new = false;
        for hook in &mut self.all {
            let of_component = matches!(hook.owner, Owner::Component | Owner::Options);
            if of_component && hook.callback.path == path && hook.callback.number >= first {
                hook.owner = owner;
                has_new = true;
            }
        }
        has_new
    }

    /// Returns whether callbacks of a failed `init` of the component at `path` have not returned.
    pub(super) fn hang(&self, path: &str) -> bool {
        let of_failed = |hook: &Hook| hook.callback.path == path && hook.owner == Owner::FailedInit;
        self.all.iter().any(|hook| of_failed(hook) && lock(&hook.callback.runs).is_running)
    }

    fn fitting(&self, fits: &dyn Fn(&Hook) -> bool) -> Vec<Arc<Callback>> {
        self.all.iter().filter(|hook| fits(hook)).map(|hook| Arc::clone(&hook.callback)).collect()
    }

    fn take(&mut self, fits: &dyn Fn(&Hook) -> bool) -> Forgotten {
        self.all.extract_if(.., |hook| fits(hook)).map(|hook| hook.callback).collect()
    }

    pub(super) fn take_one(&mut self, number: u64) -> Forgotten {
        self.take(&|hook| hook.callback.number == number)
    }

    pub(super) fn take_of_execution(&mut self, execution: u64) -> Forgotten {
        self.take(&|hook| hook.owner == Owner::Execution(execution))
    }

    /// Removes those of a component that is given up.
    pub(super) fn take_failed(&mut self, path: &str) -> Forgotten {
        self.take(&|hook| hook.callback.path == path && hook.owner == Owner::FailedInit)
    }

    pub(super) fn take_all(&mut self) -> Forgotten {
        self.take(&|_| true)
    }
}

/// Callbacks of a component that run together outside of a disarming.
pub(super) struct Apart {
    pub(super) key: Key,
    pub(super) path: &'static str,
    /// `true` if the component's `init` has failed: an unplugged device is not dangerous. Each callback that succeeds is forgotten; one
    /// that fails is a fault, and stays for the next disarming. Otherwise hardware was started on a disarmed robot, and one that fails
    /// is a hardware error.
    pub(super) is_failed_init: bool,
    /// The numbers of those that have not returned.
    pub(super) left: Vec<u64>,
}

impl State {
    /// Returns whether somebody waits for a callback to run for that reason.
    fn is_wanted(&self, reason: Reason, number: u64) -> bool {
        match reason {
            Reason::Disarming(generation) => {
                let disarming = self.disarming.as_ref().filter(|disarming| disarming.generation == generation);
                disarming.is_some_and(|disarming| disarming.left.iter().any(|(other, _)| *other == number))
            }
            Reason::Apart(key) => self.apart.iter().any(|apart| apart.key == key && apart.left.contains(&number)),
        }
    }

    /// The paths of components that are made safe outside of a disarming.
    pub(super) fn being_made_safe(&self) -> impl Iterator<Item = &'static str> {
        self.apart.iter().map(|apart| apart.path)
    }
}

/// Returns whether the calling thread runs code of `robot` that its disarming waits for: a disarm callback, or an actuator's code,
/// which the actuator's callback waits for.
pub(crate) fn is_awaited(robot: usize) -> bool {
    let is_awaited =
        |place| matches!(place, Place::Callback(of) | Place::Actuator { robot: of, .. } if of == robot);
    times_inside(is_awaited) > 0
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::control::bare;
    use crate::node::Mode;
    use std::sync::mpsc;
    use std::time::Duration;

    /// A callback that may hang does not use the thread that is kept for another component's callback.
    #[test]
    fn a_callback_without_a_thread_takes_none_that_is_kept_for_another() {
        let control = bare::control(Mode::Real, &[], []);
        let _place = control.0.reserve.place().expect("there are threads");
        let ((begin, started), (release, released)) = (mpsc::channel(), mpsc::channel::<()>());
        let code = Mutex::new((begin, released));
        let code = move || {
            let code = lock(&code);
            code.0.send(()).expect("the test waits");
            // Until the test drops the other end.
            let _ = code.1.recv();
            Ok(())
        };
        let callback = control.lock().hooks.make("command/grip", Arc::new(code), None);
        callback.start(&control, Reason::Disarming(1));
        started.recv_timeout(Duration::from_secs(20)).expect("it runs");
        assert_eq!(control.0.reserve.free(), 1, "the thread that is kept");
        drop(release);
    }
}
