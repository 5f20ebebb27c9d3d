//! Attributes panics in the code of a payload to the estimator that emitted it: that code (`clone` for a subscriber, say) runs
//! wherever the message is passed on.

use super::Environment;
use crate::declaration::EstimatorDeclaration;
use crate::fault::{Failed, Fault, caught, of_panic};
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

thread_local! {
    /// The estimator whose output's code panicked on this thread, until it is reported.
    static CULPRIT: Cell<Option<usize>> = const { Cell::new(None) };
}

/// A guard while an estimator's output is passed on. It does nothing unless that panics.
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

/// Runs code that passes messages on. A panic in the code of an estimator's output is reported as that estimator's; any other
/// failure is returned.
pub(crate) fn contained(environment: &Environment, run: impl FnOnce()) -> Result<(), Failed> {
    let done = caught(|| {
        run();
        Ok(())
    });
    done.or_else(|failed| blame(environment, failed))
}

/// The same for a caller outside; any other panic is resumed.
pub(crate) fn contained_outside(environment: &Environment, run: impl FnOnce()) {
    let Err(panic) = catch_unwind(AssertUnwindSafe(run)) else { return };
    match take_culprit(environment) {
        Some(declared) => report(environment, declared, &of_panic(panic)),
        None => resume_unwind(panic),
    }
}

/// Reports a failure that was caught while messages were passed on, if it was an estimator's output, or returns it.
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
    // Islands that were left by the unwinding have not looked at their inboxes.
    let mut islands: Vec<_> = environment.nodes().iter().map(|node| node.declaration().island).collect();
    islands.dedup();
    islands.into_iter().for_each(|island| environment.schedule_drain(island));
}
