//! What follows from a run and from a message that was not used: counts, durations, telemetry and health.

use super::Node;
use crate::component::{Estimator, SyncMiss};
use crate::declaration::InputDeclaration;
use crate::event::{HealthReason, HealthState, HealthTransition};
use crate::message::Stamp;
use crate::node::environment::{Missing, Mode};
use crate::node::health::Event;
use crate::node::timing::{Begun, Measured};
use crate::node::turn::Turn;
use crate::node::{DropReason, HealthReport, Report};
use crate::telemetry::TelemetryEvent;
use crate::time::MonotonicTime;

impl<E: Estimator> Node<E> {
    /// `source` is the driver's publisher after a run on its message.
    #[inline]
    pub(super) fn complete(
        &mut self,
        diverged: Option<&'static str>,
        has_asked: bool,
        bad: Option<HealthReason>,
        source: Option<&'static str>,
        has_emitted: bool,
        turn: &Turn<'_>,
    ) {
        if has_asked {
            self.schedule();
        }
        if bad.is_some() || diverged.is_some() || self.health.state != HealthState::Healthy {
            turn.timing().interrupt();
            self.assess(bad, diverged, source, turn.now());
        } else if source.is_some() {
            self.was_good = true;
        }
        if has_emitted {
            self.shared.counters().emitted.increment();
            turn.begin_emission(self.declaration);
        } else {
            turn.no_emission();
        }
    }

    #[cold]
    pub(super) fn assess(
        &mut self,
        bad: Option<HealthReason>,
        diverged: Option<&'static str>,
        source: Option<&'static str>,
        now: MonotonicTime,
    ) {
        if let Some(reason) = diverged {
            self.shared.counters().diverge(reason);
            tracing::debug!(estimator = self.declaration.path, reason, "diverged");
        }
        let bad = bad.or(diverged.map(|_| HealthReason::Diverged));
        let path = source.unwrap_or(self.declaration.path);
        if source.is_some() {
            self.was_good = bad.is_none();
            self.judge(Event::Run, path, now);
        }
        match bad {
            Some(reason) => self.judge(Event::Bad(reason), path, now),
            None if source.is_some() => self.judge(Event::Good, path, now),
            None => {}
        }
    }

    /// Measures a callback that has begun; returns a reason if it exceeded its budget. `driver` is the input passed to the callback
    /// and the message's stamp.
    pub(super) fn measure(
        &mut self,
        begun: Begun,
        driver: Option<(usize, MonotonicTime)>,
        turn: &Turn<'_>,
    ) -> Option<HealthReason> {
        let budget = self.declaration.health.latency_budget_nanos;
        let Measured { end, nanos } = turn.timing().end(begun, turn.environment(), || {
            if turn.environment().mode() == Mode::Replay && budget.is_some() {
                let nanos = self.shared.replayed_latency_nanos();
                nanos.unwrap_or_else(|| self.miss_in_journal("how long its callback took".to_owned()))
            } else {
                self.shared.pretended_latency_nanos()
            }
        });
        let counters = self.shared.counters();
        counters.latency.add(nanos.max(0) as u64);
        if let Some((input, stamp)) = driver
            && let Some(age) = counters.inputs.get(input).and_then(|input| input.age.as_ref())
        {
            age.add(end.nanos_since(stamp).max(0) as u64);
        }
        if let Some(telemetry) = self.environment.telemetry() {
            let duration = std::time::Duration::from_nanos(nanos.max(0) as u64);
            let event = TelemetryEvent::Latency { estimator: self.declaration.path, duration };
            telemetry.tell(self.environment.origin().robot, &event);
            turn.timing().interrupt();
        }
        let budget = budget?;
        turn.keep(self.shared.number(), nanos);
        (nanos > budget).then_some(HealthReason::LatencyOverrun)
    }

    /// In a replay: the journal does not have the value that the estimator asks for.
    #[cold]
    pub(super) fn miss_in_journal<D: Default>(&self, what: String) -> D {
        self.environment.replayed().miss(Missing { estimator: self.declaration.path, what });
        D::default()
    }

    #[cold]
    pub(super) fn judge(&mut self, event: Event, source: &'static str, time: MonotonicTime) {
        let from = self.health.state;
        let Some((to, reason)) = self.health.on(event, self.declaration.health.recover_after) else { return };
        let transition = HealthTransition { estimator: self.declaration.path, source, from, to, reason, time };
        let report = HealthReport { transition, epoch: self.epoch };
        self.environment.overseer().report(self.shared.number(), Report::Health(report));
    }

    #[cold]
    pub(super) fn refuse(&self, input: &InputDeclaration, reason: DropReason, time_nanos: i64) {
        self.shared.counters().drop(input.index, reason);
        let (estimator, input, reason) = (self.declaration.path, input.name, reason.name());
        tracing::debug!(estimator, input, reason, time_nanos, "message dropped");
        self.tell_drop(input, reason);
    }

    #[cold]
    pub(super) fn miss(&mut self, miss: SyncMiss, turn: &Turn<'_>) {
        self.shared.counters().drop(miss.input, DropReason::SyncMiss);
        let Some(input) = self.declaration.inputs.get(miss.input) else { return };
        let (age_nanos, tolerance_nanos) = (miss.age_nanos, input.tolerance_nanos);
        let estimator = self.declaration.path;
        tracing::debug!(estimator, input = input.name, age_nanos, tolerance_nanos, "dispatch dropped for sync");
        self.tell_drop(input.name, DropReason::SyncMiss.name());
        self.judge(Event::Bad(HealthReason::SyncMiss), input.source, turn.now());
    }

    #[cold]
    pub(super) fn tell_input(&self, input: usize, stamp: Stamp, turn: &Turn<'_>) {
        if let Some(telemetry) = turn.environment().telemetry()
            && let Some(input) = self.declaration.inputs.get(input)
        {
            let event = TelemetryEvent::Input { estimator: self.declaration.path, input: input.name, stamp };
            telemetry.tell(self.environment.origin().robot, &event);
            turn.timing().interrupt();
        }
    }

    #[cold]
    pub(super) fn tell_drop(&self, input: &'static str, reason: &'static str) {
        if let Some(telemetry) = self.environment.telemetry() {
            let event = TelemetryEvent::Dropped { estimator: self.declaration.path, input, reason };
            telemetry.tell(self.environment.origin().robot, &event);
        }
    }
}
