//! An estimator that has failed: what its supervisor says, and how it is made anew.

use super::{Node, Recipe};
use crate::component::{Context, Estimator, Then};
use crate::node::health::Event;
use crate::node::timers::Timers;
use crate::node::{EstimatorDeclaration, HealthReason};
use crate::run::{Failed, Failures, caught, retire};
use crate::time::MonotonicTime;

/// What is known of its failures.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Restart {
    /// When it is made anew, if it is.
    pub(super) at: Option<MonotonicTime>,
    failures: Failures,
}

impl<E: Estimator> Node<E> {
    #[cold]
    pub(super) fn fail(&mut self, Failed { fault, panicked }: Failed, now: MonotonicTime) {
        self.startup.fault(self.declaration.path, &fault);
        self.shared.set_stopped(Some(fault.to_string()));
        if let Some(estimator) = self.estimator.take() {
            // What goes wrong from here on follows from the fault that is known.
            let _ = retire(estimator, panicked, E::terminate);
        }
        self.judge(Event::Bad(HealthReason::Restarted), self.declaration.path, now);
        if fault.then == Then::Restart {
            self.plan_restart(now);
        }
    }

    /// Asks its supervisor.
    pub(super) fn plan_restart(&mut self, now: MonotonicTime) {
        let EstimatorDeclaration { supervisor, path, .. } = *self.declaration;
        self.restart.at = self.startup.failed(&mut self.restart.failures, supervisor, path, now, false);
        self.schedule();
    }

    /// Its supervisor starts it anew, though it has not failed.
    pub(super) fn leave_for_restart(&mut self, now: MonotonicTime) {
        if let Some(estimator) = self.estimator.take() {
            let _ = retire(estimator, false, E::terminate);
            self.restart.at = Some(now);
        }
    }

    #[cold]
    pub(super) fn make_anew(&mut self, now: MonotonicTime) {
        let Recipe { options, binding, cache } = &self.recipe;
        let context = Context::new(self.startup.robot(), self.declaration, now);
        let options = self.startup.bound(options, *binding);
        let made = options.and_then(|options| caught(|| E::init(options, &context)).map_err(|failed| failed.fault));
        self.restart.at = None;
        match made {
            Ok(estimator) => {
                self.estimator = Some(estimator);
                self.cache = cache();
                self.timers = Timers::default();
                self.last_input = now;
                self.shared.counters().restarts.increment();
                self.shared.set_stopped(None);
                tracing::info!(estimator = self.declaration.path, "started anew");
                for request in context.into_requests() {
                    self.timers.request(request, now);
                }
                self.schedule();
            }
            Err(fault) => self.fail(Failed { fault, panicked: false }, now),
        }
    }
}
