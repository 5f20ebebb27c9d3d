//! Whose output's code panicked: that of a payload is run by whoever hands it on (its `clone` for a subscriber, say), far from
//! the estimator that emitted it.

use super::Environment;
use crate::declaration::EstimatorDeclaration;
use crate::fault::{Failed, Fault, caught, of_panic};
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
        Some(declared) => report(environment, declared, &of_panic(panic)),
        None => resume_unwind(panic),
    }
}

/// What was caught where messages are handed on: reported if it was an estimator's output, else returned.
#[cold]
pub(crate) fn blame(environment: &Environment, failed: Failed) -> Result<(), Failed> {
    match take_culprit(environment).filter(|_| failed.panicked) {
        Some(declared) => {
            report(environment, declared, &failed.fault);
            Ok(())
        }
        None => Err(failed),
    }
}

fn take_culprit(environment: &Environment) -> Option<&'static EstimatorDeclaration> {
    CULPRIT.take().and_then(|number| environment.nodes().get(number)).map(|node| node.declaration())
}

fn report(environment: &Environment, declared: &'static EstimatorDeclaration, fault: &Fault) {
    environment.overseer().output_failed(declared, format!("its output {fault}"));
    // Islands that were left in haste have not looked at their inboxes.
    let mut islands: Vec<_> = environment.nodes().iter().map(|node| node.declaration().island).collect();
    islands.dedup();
    islands.into_iter().for_each(|island| environment.schedule_drain(island));
}
