//! Consequences of a run, and of a message that was not used: counts, durations, telemetry and health.

use super::common::Common;
use super::placing::Unplaced;
use crate::component::SyncMiss;
use crate::event::{HealthReason, HealthState, HealthTransition};
use crate::message::Stamp;
use crate::node::environment::{Missing, Mode};
use crate::node::health::Event;
use crate::node::timing::{Begun, Measured};
use crate::node::turn::Turn;
use crate::node::{DropReason, HealthReport, Report};
use crate::telemetry::TelemetryEvent;
use crate::time::MonotonicTime;

impl Common {
    /// Begins a run on a message of the driving input, and the measurement of its duration if it is measured: all runs where a latency budget
    /// is declared or a telemetry handler listens, else every 64th.
    #[inline]
    pub(super) fn begin(&self, turn: &Turn<'_>) -> Option<Begun> {
        if self.shared.counters().dispatched.increment() & self.unmeasured == 0 {
            return Some(turn.timing().begin(turn.environment()));
        }
        turn.timing().interrupt();
        None
    }

    /// Begins any other callback.
    pub(super) fn begin_other(&self, turn: &Turn<'_>) -> Option<Begun> {
        turn.timing().interrupt();
        (self.unmeasured == 0).then(|| turn.timing().begin(turn.environment()))
    }

    /// Completes a run on the driving input's message of `time`, which came at that input.
    #[inline]
    pub(super) fn complete(
        &mut self,
        input: usize,
        time: MonotonicTime,
        begun: Option<Begun>,
        diverged: Option<&'static str>,
        turn: &Turn<'_>,
    ) {
        self.shared.set_last_run(turn.now());
        let mut bad = match begun {
            Some(begun) => self.measure(begun, Some((input, time)), turn),
            None => None,
        };
        if let Some(limit) = self.stale_after_nanos
            && turn.now().nanos_since(time) > limit
        {
            bad = bad.or(Some(HealthReason::StaleInput));
        }
        if bad.is_some() || diverged.is_some() || self.health.state != HealthState::Healthy {
            self.assess(bad, diverged, Some(input), turn);
        } else {
            self.was_good = true;
        }
    }

    /// Completes any other callback; returns the stamp of what it has emitted.
    pub(super) fn complete_other(
        &mut self,
        begun: Option<Begun>,
        diverged: Option<&'static str>,
        turn: &Turn<'_>,
    ) -> Stamp {
        let bad = begun.and_then(|begun| self.measure(begun, None, turn));
        if bad.is_some() || diverged.is_some() {
            self.assess(bad, diverged, None, turn);
        }
        let now = turn.now();
        Stamp { monotonic_time: now, wall_time: turn.wall_at(now), ..self.template }
    }

    /// Schedules what a callback has asked for, and counts what it has emitted.
    #[inline]
    pub(super) fn settle(&mut self, has_asked: bool, has_emitted: bool, turn: &Turn<'_>) {
        if has_asked {
            self.wake_at(self.timers.next());
        }
        if has_emitted {
            self.shared.counters().emitted.increment();
        }
        if turn.is_observed() {
            turn.note_reply(self.declaration, has_emitted);
        }
    }

    #[cold]
    pub(super) fn assess(
        &mut self,
        bad: Option<HealthReason>,
        diverged: Option<&'static str>,
        driver: Option<usize>,
        turn: &Turn<'_>,
    ) {
        turn.timing().interrupt();
        let now = turn.now();
        if let Some(reason) = diverged {
            self.shared.counters().diverge(reason);
            tracing::debug!(estimator = self.declaration.path, reason, "diverged");
        }
        let bad = bad.or(diverged.map(|_| HealthReason::Diverged));
        let source = driver.and_then(|input| self.declaration.inputs.get(input)).map(|input| input.source);
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

    /// Measures a callback that has begun; returns a reason if it exceeded its budget. `driver` is the driving input and the
    /// stamp of its message.
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

    /// Reports, in a replay, that the journal does not have the value that the estimator asks for.
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
    pub(super) fn refuse(&self, input: usize, reason: DropReason, time: MonotonicTime, turn: &Turn<'_>) {
        turn.timing().interrupt();
        self.shared.counters().drop(input, reason);
        let Some(input) = self.declaration.inputs.get(input) else { return };
        let (estimator, input, reason) = (self.declaration.path, input.name, reason.name());
        let time_nanos = time.as_nanos();
        tracing::debug!(estimator, input, reason, time_nanos, "message dropped");
        self.tell_drop(input, reason);
    }

    #[cold]
    pub(super) fn miss(&mut self, miss: SyncMiss, turn: &Turn<'_>) {
        turn.timing().interrupt();
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

    /// Finds the transforms for a dispatch on a message of the driving input; returns `false` if the dispatch is dropped.
    pub(super) fn place(&mut self, driver_time: MonotonicTime, turn: &Turn<'_>) -> bool {
        turn.timing().interrupt();
        match self.placing.place(driver_time, &self.admission, turn) {
            Ok(()) => true,
            Err(unplaced) => {
                self.note_unplaced(&unplaced, turn);
                false
            }
        }
    }

    #[cold]
    fn note_unplaced(&mut self, unplaced: &Unplaced, turn: &Turn<'_>) {
        let Unplaced::Gap { input, error } = unplaced else { return };
        self.shared.counters().drop(*input, DropReason::NoTransform);
        let Some(input) = self.declaration.inputs.get(*input) else { return };
        let (estimator, name) = (self.declaration.path, input.name);
        tracing::debug!(estimator, input = name, %error, "dispatch dropped for want of a transform");
        self.shared.set_last_gap(error.clone());
        self.tell_drop(name, DropReason::NoTransform.name());
        self.judge(Event::Bad(HealthReason::NoTransform), input.source, turn.now());
    }
}
