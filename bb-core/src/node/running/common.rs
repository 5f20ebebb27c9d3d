//! The part of a node that does not depend on the estimator's type.

use super::placing::Placing;
use crate::component::{Context, Guardian, Request};
use crate::declaration::{EstimatorDeclaration, ParameterValues};
use crate::fault::{Failed, caught};
use crate::message::Stamp;
use crate::node::Report;
use crate::node::admission::Admission;
use crate::node::counters::SAMPLED;
use crate::node::environment::Environment;
use crate::node::health::Health;
use crate::node::shared::{SharedNode, Stopped};
use crate::node::timers::Timers;
use crate::node::turn::Turn;
use crate::time::MonotonicTime;
use std::sync::Arc;

/// The declaration of an estimator, and all of its state but the estimator itself and its messages.
pub(super) struct Common {
    /// Number among the robot's estimators.
    pub(super) number: u32,
    pub(super) declaration: &'static EstimatorDeclaration,
    pub(super) template: Stamp,
    /// Greatest age of a message of the driving input when it arrives.
    pub(super) stale_after_nanos: Option<i64>,
    /// A run is not measured if its number has one of these bits.
    pub(super) unmeasured: u64,
    /// `true` if the estimator takes transforms across moving joints: see `placing`.
    pub(super) handles_moving_joints: bool,
    pub(super) shared: SharedNode,
    pub(super) environment: Environment,
    pub(super) admission: Admission,
    /// The transforms of its inputs, if some of them span moving joints.
    pub(super) placing: Placing,
    pub(super) health: Health,
    /// Number of losses that the estimator knows of.
    pub(super) epoch: u32,
    /// `true` if the last run was good.
    pub(super) was_good: bool,
    pub(super) timers: Timers,
    /// The latest time at which its island is woken for it.
    pub(super) scheduled: Option<MonotonicTime>,
    /// Number of times in a row that it has continued its work.
    pub(super) continued: u32,
    /// The requests made in its first `init`, kept until it starts.
    pub(super) requested: Vec<Request>,
    /// The parameter values that it received last.
    pub(super) parameters: ParameterValues,
}

impl Common {
    /// Notes the options, as `shown`, among the facts of the robot.
    pub(super) fn new(
        number: usize,
        handles_moving_joints: bool,
        environment: &Environment,
        shown: &dyn Fn() -> String,
    ) -> Self {
        let shared = environment.node(number);
        let declaration = shared.declaration();
        let placing = Placing::new(number, declaration, environment);
        let replacement = environment.replacement(declaration.path);
        if let Some(fault) = replacement.and_then(|replacement| placing.fault_of(replacement)) {
            environment.refuse(declaration.path, fault);
        }
        let fact = || match replacement {
            Some(replacement) => format!("replacement of {}: {}", declaration.path, replacement.shown()),
            None => format!("options of {}: {}", declaration.path, shown()),
        };
        match caught(|| Ok(fact())) {
            Ok(fact) => environment.add_fact(fact),
            Err(failed) => environment.refuse(declaration.path, failed.fault),
        }
        Self {
            number: number as u32,
            declaration,
            template: Stamp { frame: declaration.frame, origin: environment.origin(), ..Stamp::default() },
            stale_after_nanos: declaration.driver().and_then(|driver| driver.stale_after_nanos),
            unmeasured: match declaration.health.latency_budget_nanos {
                None if environment.telemetry().is_none() => SAMPLED - 1,
                _ => 0,
            },
            handles_moving_joints: replacement
                .map_or(handles_moving_joints, |replacement| replacement.handles_moving_joints()),
            shared,
            environment: environment.clone(),
            admission: Admission::new(declaration.inputs.len()),
            placing,
            health: Health::default(),
            epoch: 0,
            was_good: false,
            timers: Timers::default(),
            scheduled: None,
            continued: 0,
            requested: Vec::new(),
            parameters: environment.overseer().parameters(),
        }
    }

    /// Takes the request of a reply, which ends a timeout; returns whether there is one.
    #[inline]
    pub(super) fn take_request(&mut self, request: Option<Request>, turn: &Turn<'_>) -> bool {
        self.timers.happened();
        match request {
            None => false,
            Some(request) => {
                self.timers.request(request, turn.now());
                true
            }
        }
    }

    /// Wakes the island at `next`, unless it is woken before.
    pub(super) fn wake_at(&mut self, next: Option<MonotonicTime>) {
        if let Some(next) = next
            && self.scheduled.is_none_or(|scheduled| next < scheduled)
        {
            self.scheduled = Some(next);
            self.environment.agenda().wake_at(next, self.declaration.island);
        }
    }

    pub(super) fn report_failure(&self, failed: &Failed) {
        let Failed { fault, panicked } = failed;
        let report = Report::Failed { message: fault.to_string(), panicked: *panicked };
        self.environment.overseer().report(self.shared.number(), report);
    }

    pub(super) fn set_stopped(&self, reason: Option<(String, bool)>) {
        self.shared.set_stopped(reason.map(|(reason, for_good)| Stopped { reason, for_good }));
    }

    pub(super) fn context(&self, now: MonotonicTime) -> Context {
        let guardian: Arc<dyn Guardian> = Arc::clone(self.environment.overseer()) as _;
        let replacement = self.environment.replacement(self.declaration.path).cloned();
        Context::new(self.environment.origin().robot, self.declaration, now, Some(guardian))
            .with_replacement(replacement)
    }

    /// Takes the requests made in `init` or `handle_options`.
    pub(super) fn take_requests(&mut self, requests: Vec<Request>, now: MonotonicTime) {
        for request in requests {
            self.timers.request(request, now);
        }
    }
}
