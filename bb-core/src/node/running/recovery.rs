//! Creation, failure and restart of an estimator.

use super::{Context, Node};
use crate::component::Estimator;
use crate::event::HealthReason;
use crate::fault::{Failed, Fault};
use crate::lifecycle::AfterFault;
use crate::node::admission::Admission;
use crate::node::environment::Environment;
use crate::node::health::Event;
use crate::node::timers::Timers;
use crate::node::turn::Turn;
use crate::node::{DropReason, Report};
use crate::time::MonotonicTime;

impl<E: Estimator> Node<E> {
    /// Creates the estimator for the first time. A failure that prevents the robot from starting is stored in the environment.
    pub(super) fn make_first(&mut self, now: MonotonicTime) {
        let context = self.context(now);
        self.shared.set_last_run(now);
        let (slot, parameters) = (&mut self.slot, &self.parameters);
        let (environment, path) = (&self.environment, self.declaration.path);
        let made = environment.make(path, || {
            let made = replacing_hooks(environment, path, true, || slot.make(&context, parameters));
            made.map_err(|failed| failed.fault)
        });
        match made {
            Ok(()) => self.requested = context.into_requests(),
            Err(skipped) => {
                self.slot.stop();
                let reason = skipped.unwrap_or_else(|| "the robot does not start".to_owned());
                self.set_stopped(Some((reason, true)));
            }
        }
    }

    /// Starts the estimator; one that was left out is not healthy.
    pub(super) fn begin(&mut self, turn: &Turn<'_>) {
        self.shared.set_last_run(turn.now());
        if !self.slot.is_running() {
            self.judge(Event::Bad(HealthReason::Stopped), self.declaration.path, turn.now());
        }
        for request in std::mem::take(&mut self.requested) {
            self.timers.request(request, turn.now());
        }
    }

    #[cold]
    pub(super) fn fail(&mut self, failed: Failed, turn: &Turn<'_>) {
        self.report_failure(&failed);
        let after = self.slot.fail(&failed, turn.now());
        let for_good = after == AfterFault::Stopped;
        self.set_stopped(Some((failed.fault.to_string(), for_good)));
        let reason = if for_good { HealthReason::Stopped } else { HealthReason::Restarted };
        if for_good {
            self.drop_backlog();
        }
        self.judge(Event::Bad(reason), self.declaration.path, turn.now());
        self.schedule();
    }

    pub(super) fn report_failure(&self, failed: &Failed) {
        let Failed { fault, panicked } = failed;
        let report = Report::Failed { message: fault.to_string(), panicked: *panicked };
        self.environment.overseer().report(self.shared.number(), report);
    }

    /// Restarts the estimator when its backoff is over or its supervisor requests it.
    pub(super) fn restart(&mut self, turn: &Turn<'_>) {
        let context = self.context(turn.now());
        let (slot, parameters) = (&mut self.slot, &self.parameters);
        let made =
            replacing_hooks(&self.environment, self.declaration.path, true, || slot.make(&context, parameters));
        match made {
            Ok(()) => self.refresh(context, turn.now()),
            Err(failed) => self.fail(failed, turn),
        }
    }

    /// Restarts the estimator at its supervisor's request, though it has not failed.
    pub(super) fn restart_from_above(&mut self, turn: &Turn<'_>) {
        if self.slot.restart(turn.now()) {
            self.judge(Event::Bad(HealthReason::Restarted), self.declaration.path, turn.now());
        }
    }

    /// Applies new parameter values.
    pub(super) fn change_options(&mut self, turn: &Turn<'_>) {
        let context = self.context(turn.now());
        let (slot, parameters) = (&mut self.slot, &self.parameters);
        let changed =
            replacing_hooks(&self.environment, self.declaration.path, false, || slot.change(&context, parameters));
        match changed {
            Ok(true) => {
                for request in context.into_requests() {
                    self.timers.request(request, turn.now());
                }
                self.schedule();
            }
            Ok(false) => {
                self.restart_from_above(turn);
                self.restart(turn);
            }
            Err(failed) => self.fail(failed, turn),
        }
    }

    /// Resets everything but the backlog and the health.
    fn refresh(&mut self, context: Context, now: MonotonicTime) {
        self.cache = (self.make_cache)();
        self.admission = Admission::new(self.declaration.inputs.len());
        self.timers = Timers::default();
        self.continued = 0;
        self.shared.counters().restarts.increment();
        self.set_stopped(None);
        tracing::info!(estimator = self.declaration.path, "restarted");
        for request in context.into_requests() {
            self.timers.request(request, now);
        }
        self.schedule();
    }

    /// Counts waiting messages as dropped when the estimator stops for good.
    pub(super) fn drop_backlog(&mut self) {
        let counters = self.shared.counters();
        self.backlog.clear().for_each(|input| counters.drop(input, DropReason::Stopped));
    }
}

/// Runs `make`; the disarm callbacks registered by `make` replace earlier ones.
fn replacing_hooks<T>(
    environment: &Environment,
    path: &'static str,
    is_made: bool,
    make: impl FnOnce() -> Result<T, Failed>,
) -> Result<T, Failed> {
    let (mut make, mut made) = (Some(make), None);
    let not_made = || Failed::from(Fault::new("it was not made"));
    environment.overseer().replacing_hooks(path, is_made, &mut || {
        made = Some(make.take().ok_or_else(not_made)?()?);
        Ok(())
    })?;
    made.ok_or_else(not_made)
}
