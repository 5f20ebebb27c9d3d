//! Creation, failure and restart of an estimator.

use super::common::Common;
use super::{Next, Node};
use crate::component::{Context, Estimator};
use crate::event::HealthReason;
use crate::fault::{Failed, Panic, Termination, caught, of_panic};
use crate::lifecycle::AfterFault;
use crate::node::DropReason;
use crate::node::admission::Admission;
use crate::node::health::Event;
use crate::node::timers::Timers;
use crate::node::turn::Turn;
use crate::time::MonotonicTime;

impl<E: Estimator> Node<E> {
    /// Creates the estimator for the first time. A failure that prevents the robot from starting is stored in the environment.
    pub(super) fn make_first(&mut self, now: MonotonicTime) {
        let Self { common, slot, .. } = self;
        let context = common.context(now);
        if common.make_first(now, &mut || slot.make(&context, &common.parameters)) {
            self.common.requested = context.into_requests();
        } else {
            self.slot.stop();
        }
    }

    #[cold]
    pub(super) fn fail(&mut self, failed: Failed, turn: &Turn<'_>) {
        turn.no_emission();
        self.common.report_failure(&failed);
        let after = self.slot.fail(&failed, turn.now());
        if after == AfterFault::Stopped {
            self.drop_backlog();
        }
        self.common.note_failure(&failed, after, turn);
        self.schedule();
    }

    /// Handles a panic of the estimator's code, or of a message that it emitted or kept.
    #[cold]
    pub fn panicked(&mut self, panic: Panic, turn: &Turn<'_>) {
        let failed = Failed { fault: of_panic(panic), panicked: true };
        if self.slot.is_running() {
            self.fail(failed, turn);
        } else {
            self.common.report_failure(&failed);
        }
    }

    /// Restarts the estimator when its backoff is over or its supervisor requests it.
    pub(super) fn restart(&mut self, turn: &Turn<'_>) {
        let Self { common, slot, .. } = self;
        let context = common.context(turn.now());
        match common.replacing_hooks(true, &mut || slot.make(&context, &common.parameters)) {
            Ok(()) => self.refresh(context, turn.now()),
            Err(failed) => self.fail(failed, turn),
        }
    }

    /// Restarts the estimator, though it has not failed.
    pub(super) fn restart_from_above(&mut self, reason: Termination<'_>, turn: &Turn<'_>) {
        if self.slot.restart(turn.now(), reason) {
            let source = self.common.declaration.path;
            self.common.judge(Event::Bad(HealthReason::Restarted), source, turn.now());
        }
    }

    /// Lets the estimator emit what it still holds, before it is terminated. After a panic it has failed, and has been dropped.
    pub(super) fn end(&mut self, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        let Some(estimator) = self.slot.running() else { return Next::Quiet };
        turn.enter(self.common.number);
        match caught(|| Ok(estimator.handle_end())) {
            Ok(None) => Next::Quiet,
            Ok(output) => {
                *emitted = output;
                let stamp = self.common.complete_other(None, None, turn);
                self.common.settle(false, true, turn);
                Next::Emitted(stamp)
            }
            Err(failed) => {
                self.fail(failed, turn);
                Next::Quiet
            }
        }
    }

    /// Applies new parameter values.
    pub(super) fn change_options(&mut self, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        let Self { common, slot, .. } = self;
        let context = common.context(turn.now());
        let mut is_kept = true;
        let changed = common.replacing_hooks(false, &mut || {
            is_kept = slot.change(&context, &common.parameters)?;
            Ok(())
        });
        match changed {
            Ok(()) if is_kept => {
                self.common.take_requests(context.into_requests(), turn.now());
                self.schedule();
            }
            Ok(()) => {
                let ended = self.end(turn, emitted);
                self.restart_from_above(Termination::NewOptions, turn);
                self.restart(turn);
                return ended;
            }
            Err(failed) => self.fail(failed, turn),
        }
        Next::Quiet
    }

    /// Resets everything but the backlog and the health.
    fn refresh(&mut self, context: Context, now: MonotonicTime) {
        self.common.refresh(context, now);
        self.schedule();
        self.cache = (self.make_cache)();
    }

    /// Counts waiting messages as dropped when the estimator stops for good.
    pub(super) fn drop_backlog(&mut self) {
        let counters = self.common.shared.counters();
        self.backlog.clear().for_each(|input| counters.drop(input, DropReason::Stopped));
    }
}

impl Common {
    /// Calls `make`; returns `false` if the estimator does not run.
    fn make_first(&self, now: MonotonicTime, make: &mut dyn FnMut() -> Result<(), Failed>) -> bool {
        self.shared.set_last_run(now);
        let made = self
            .environment
            .make(self.declaration.path, || self.replacing_hooks(true, make).map_err(|failed| failed.fault));
        if let Err(skipped) = &made {
            if skipped.is_some() {
                self.shared.leave_out();
            }
            let reason = skipped.clone().unwrap_or_else(|| "the robot does not start".to_owned());
            self.set_stopped(Some((reason, true)));
        }
        made.is_ok()
    }

    /// Applies the requests of `init` when the robot has started.
    pub(super) fn begin_life(&mut self, turn: &Turn<'_>) {
        self.shared.set_last_run(turn.now());
        let requested = std::mem::take(&mut self.requested);
        self.take_requests(requested, turn.now());
    }

    fn note_failure(&mut self, failed: &Failed, after: AfterFault, turn: &Turn<'_>) {
        let for_good = after == AfterFault::Stopped;
        self.set_stopped(Some((failed.fault.to_string(), for_good)));
        let reason = if for_good { HealthReason::Stopped } else { HealthReason::Restarted };
        self.judge(Event::Bad(reason), self.declaration.path, turn.now());
    }

    fn refresh(&mut self, context: Context, now: MonotonicTime) {
        self.admission = Admission::new(self.declaration.inputs.len());
        self.timers = Timers::default();
        self.continued = 0;
        self.shared.counters().restarts.increment();
        self.set_stopped(None);
        tracing::info!(estimator = self.declaration.path, "restarted");
        self.take_requests(context.into_requests(), now);
    }

    /// Runs `make`; the disarm callbacks registered by `make` replace earlier ones.
    fn replacing_hooks(&self, is_made: bool, make: &mut dyn FnMut() -> Result<(), Failed>) -> Result<(), Failed> {
        self.environment.overseer().replacing_hooks(self.declaration.path, is_made, make)
    }
}
