//! Whose output's code panicked: that of a payload is run by whoever hands it on (its `clone` for a subscriber, say), far from
//! the estimator that emitted it.

use super::Environment;
use super::shared::SharedNode;
use crate::fault::{Failed, Fault, caught, guarded, of_panic};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

thread_local! {
    /// The estimator whose output's code panicked on this thread, until it is reported.
    static CULPRIT: Cell<Option<usize>> = const { Cell::new(None) };
}

/// What an estimator has emitted is handed on as long as this lives. Nothing is done unless that panics.
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
    /// Of a panic: the innermost emission is the one whose code it was.
    #[cold]
    fn drop(&mut self) {
        if CULPRIT.get().is_none() {
            CULPRIT.set(Some(self.0));
        }
    }
}

/// Runs what hands on messages. A panic in the code of an estimator's output is that estimator's, and is reported as such; any
/// other failure is returned.
pub(crate) fn contained(environment: &Environment, run: impl FnOnce()) -> Result<(), Failed> {
    let done = caught(|| {
        run();
        Ok(())
    });
    done.or_else(|failed| blame(environment, failed))
}

/// The same for a caller outside, who gets any other panic.
pub(crate) fn contained_outside(environment: &Environment, run: impl FnOnce()) {
    let Err(panic) = catch_unwind(AssertUnwindSafe(run)) else { return };
    match take_culprit(environment) {
        Some(culprit) => report(environment, culprit, &of_panic(panic)),
        None => resume_unwind(panic),
    }
}

/// What was caught where messages are handed on: reported if it was an estimator's output, else returned.
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

/// Hands on what an estimator has emitted at `path`, to those outside its island: a panic in there keeps nobody else from
/// getting it.
#[cold]
pub(super) fn handed_on(environment: &Environment, path: &'static str, hand_on: impl FnOnce()) {
    if let Err(failed) = guarded(hand_on) {
        let emits = |node: &&SharedNode| node.declaration().outputs.contains(&path);
        if let Some(node) = environment.nodes().iter().find(emits) {
            report(environment, node.number(), &failed);
        }
    }
}

fn take_culprit(environment: &Environment) -> Option<usize> {
    CULPRIT.take().filter(|number| *number < environment.nodes().len())
}

/// The estimator fails, in the order of all that reaches it.
fn report(environment: &Environment, estimator: usize, fault: &Fault) {
    environment.overseer().output_failed(estimator, format!("its output {fault}"));
    // Islands that were left in haste have not looked at their inboxes.
    let mut islands: Vec<_> = environment.nodes().iter().map(|node| node.declaration().island).collect();
    islands.dedup();
    islands.into_iter().for_each(|island| environment.schedule_drain(island));
}
