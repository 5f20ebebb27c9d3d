//! Attributes panics in the code of a payload to the estimator that emitted it. That code, such as `clone` for a subscriber, runs
//! wherever the message is passed on.

use super::Environment;
use super::shared::SharedNode;
use crate::fault::{Failed, Fault, caught, guarded, of_panic};
use crate::message::{Panic, Payload, Stamped, copied};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

thread_local! {
    /// The estimator whose output's code panicked on this thread, until this is reported.
    static CULPRIT: Cell<Option<usize>> = const { Cell::new(None) };
}

/// A guard held while an estimator's output is passed on. It acts only on a panic.
pub(crate) struct Emitting(usize);

impl Emitting {
    #[inline]
    pub(crate) fn new(estimator: usize) -> Self {
        Self(estimator)
    }

    #[inline]
    pub(crate) fn done(self) {
        std::mem::forget(self);
    }
}

impl Drop for Emitting {
    /// The innermost emission is the one whose code panicked.
    #[cold]
    fn drop(&mut self) {
        if CULPRIT.get().is_none() {
            CULPRIT.set(Some(self.0));
        }
    }
}

/// Runs code that passes messages on. A panic in the code of an estimator's output is reported as a failure of that estimator; any
/// other failure is returned.
pub(crate) fn contained(environment: &Environment, run: impl FnOnce()) -> Result<(), Failed> {
    let done = caught(|| {
        run();
        Ok(())
    });
    done.or_else(|failed| blame(environment, failed))
}

/// As [`contained`], for an outside caller; any other panic is resumed.
pub(crate) fn contained_outside(environment: &Environment, run: impl FnOnce()) {
    let Err(panic) = catch_unwind(AssertUnwindSafe(run)) else { return };
    match take_culprit(environment) {
        Some(culprit) => report(environment, culprit, &of_panic(panic)),
        None => resume_unwind(panic),
    }
}

/// Reports a failure caught while messages were passed on, if an estimator's output caused it; otherwise returns it.
#[cold]
pub(crate) fn blame(environment: &Environment, failed: Failed) -> Result<(), Failed> {
    match take_culprit(environment).filter(|_| failed.panicked) {
        Some(culprit) => {
            report(environment, culprit, &failed.fault);
            Ok(())
        }
        None => Err(failed),
    }
}

/// Passes a message emitted by an estimator at `path` to subscribers outside its island. A panic there does not prevent other
/// subscribers from getting the message.
#[cold]
pub(super) fn handed_on(environment: &Environment, path: &'static str, hand_on: impl FnOnce()) {
    if let Err(fault) = guarded(hand_on) {
        charge(environment, path, &fault);
    }
}

/// Copies a message published at `path`, and charges its publisher if the payload's `Clone` panics.
pub(super) fn copied_of<T: Payload>(
    environment: &Environment,
    path: &'static str,
    message: &Stamped<T>,
) -> Option<Stamped<T>> {
    let mut panic = None;
    let copy = copied(message, &mut panic);
    if let Some(panic) = panic {
        copy_failed(environment, path, panic);
    }
    copy
}

/// Handles a panic in the payload's `Clone` while a message published at `path` was copied.
#[cold]
pub(super) fn copy_failed(environment: &Environment, path: &'static str, panic: Panic) {
    charge(environment, path, &of_panic(panic));
}

/// The number of the estimator that publishes at `path`, if there is one.
fn emitter(environment: &Environment, path: &'static str) -> Option<usize> {
    let emits = |node: &&SharedNode| node.declaration().outputs.contains(&path);
    environment.nodes().iter().find(emits).map(SharedNode::number)
}

/// Charges the publisher at `path` with a panic in its payload's code: an estimator is restarted.
fn charge(environment: &Environment, path: &'static str, fault: &Fault) {
    match emitter(environment, path) {
        Some(estimator) => report(environment, estimator, fault),
        None => environment.overseer().message_failed(path, format!("its message {fault}")),
    }
}

fn take_culprit(environment: &Environment) -> Option<usize> {
    CULPRIT.take().filter(|number| *number < environment.nodes().len())
}

/// Fails the estimator through an ordered entry of its island.
fn report(environment: &Environment, estimator: usize, fault: &Fault) {
    environment.overseer().output_failed(estimator, format!("its output {fault}"));
    // Islands left by unwinding have not checked their inboxes.
    let mut islands: Vec<_> = environment.nodes().iter().map(|node| node.declaration().island).collect();
    islands.dedup();
    islands.into_iter().for_each(|island| environment.schedule_drain(island));
}
