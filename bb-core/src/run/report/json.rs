//! A report as JSON. Times and durations are in seconds, times on the robot's own clock; what is unknown is `null`.

use super::super::{ActuatorStatistics, SourceStatistics};
use super::{Problem, Report};
use crate::component::ExecutionInfo;
use crate::control::{CommandStatistics, ReportedFault};
use crate::message::LimitedQuantity;
use crate::message::codec::compose::{array, null, number, object, optional, text};
use crate::node::{DropReason, EstimatorStatistics, InputStatistics, LatencyStatistics};
use crate::pubsub::TopicStatistics;
use crate::time::MonotonicTime;
use std::time::Duration;

impl Report {
    /// One JSON object: `time`, `state`, `safety`, the `problems` with the worst first, and the lists `executions`, `topics`, `estimators`,
    /// `sources`, `actuators`, `commands` and `faults`, whose elements have a `path`. `now` is the time at which it was made, and
    /// `executions` are those of the [`Bus`](crate::Bus::executions).
    pub fn to_json(&self, now: MonotonicTime, executions: &[ExecutionInfo]) -> String {
        object(&[
            ("time", seconds(now)),
            ("state", text(self.state)),
            ("safety", text(&self.safety.to_string())),
            ("problems", array(&mut self.problems().iter().map(problem))),
            ("executions", array(&mut executions.iter().map(execution))),
            ("topics", array(&mut self.topics.iter().map(topic))),
            ("estimators", array(&mut self.estimators.iter().map(estimator))),
            ("sources", array(&mut self.sources.iter().map(source))),
            ("actuators", array(&mut self.actuators.iter().map(actuator))),
            ("commands", array(&mut self.commands.iter().map(command))),
            ("faults", array(&mut self.faults.iter().map(fault))),
            ("all_faults", self.all_faults.to_string()),
        ])
    }
}

fn problem(problem: &Problem) -> String {
    object(&[
        ("path", text(&problem.path)),
        ("severity", text(problem.severity.name())),
        ("since", optional(problem.since, seconds)),
        ("reason", text(&problem.reason)),
    ])
}

fn execution(execution: &ExecutionInfo) -> String {
    object(&[
        ("number", execution.number.to_string()),
        ("path", text(execution.path)),
        ("caller", text(&execution.caller)),
        ("started", seconds(execution.started)),
        ("progress", execution.progress.clone().unwrap_or_else(null)),
    ])
}

fn topic(topic: &TopicStatistics) -> String {
    object(&[
        ("path", text(topic.path)),
        ("payload", text(topic.payload)),
        ("published", topic.published.to_string()),
        ("lost", topic.lost.to_string()),
        ("subscribers", topic.subscribers.to_string()),
    ])
}

fn estimator(estimator: &EstimatorStatistics) -> String {
    let last = estimator.last_transition;
    object(&[
        ("path", text(estimator.path)),
        ("health", optional(estimator.health, |health| text(&health.to_string()))),
        ("since", optional(last.map(|last| last.time), seconds)),
        ("reason", optional(last.map(|last| last.reason.to_string()), |reason| text(&reason))),
        ("source", optional(last.map(|last| last.source), text)),
        ("stopped", optional(estimator.stopped.as_deref(), text)),
        ("dispatched", estimator.dispatched.to_string()),
        ("emitted", estimator.emitted.to_string()),
        ("diverged", estimator.diverged.to_string()),
        ("restarts", estimator.restarts.to_string()),
        ("transitions", estimator.transitions.to_string()),
        ("latency", latency(&estimator.latency)),
        ("inputs", array(&mut estimator.inputs.iter().map(input))),
    ])
}

fn input(input: &InputStatistics) -> String {
    let dropped = DropReason::ALL.iter().filter(|reason| input.dropped(**reason) > 0);
    let dropped: Vec<_> = dropped.map(|reason| (reason.name(), input.dropped(*reason).to_string())).collect();
    object(&[
        ("name", text(input.name)),
        ("source", text(input.source)),
        ("received", input.received.to_string()),
        ("dropped", object(&dropped)),
        ("age", latency(&input.age)),
    ])
}

fn source(source: &SourceStatistics) -> String {
    let counts: Vec<_> = source.counts.iter().map(|(name, count)| (*name, count.to_string())).collect();
    object(&[
        ("path", text(source.path)),
        ("stopped", optional(source.stopped.as_deref(), text)),
        ("failing_since", optional(source.failing_since, seconds)),
        ("readings", source.readings.to_string()),
        ("skipped", source.skipped.to_string()),
        ("restarts", source.restarts.to_string()),
        ("counts", object(&counts)),
    ])
}

fn actuator(actuator: &ActuatorStatistics) -> String {
    let quantities = |count: fn(&ActuatorStatistics, LimitedQuantity) -> u64| {
        LimitedQuantity::ALL.iter().map(|quantity| count(actuator, *quantity)).sum::<u64>().to_string()
    };
    object(&[
        ("path", text(actuator.path)),
        ("stopped", optional(actuator.stopped.as_deref(), text)),
        ("commands", actuator.commands.to_string()),
        ("limited", quantities(ActuatorStatistics::limited)),
        ("refused", quantities(ActuatorStatistics::refused)),
    ])
}

fn command(command: &CommandStatistics) -> String {
    object(&[
        ("path", text(&format!("command/{}", command.name))),
        ("started", command.started.to_string()),
        ("succeeded", command.succeeded.to_string()),
        ("failed", command.failed.to_string()),
        ("timed_out", command.timed_out.to_string()),
        ("cancelled", command.cancelled.to_string()),
        ("refused", command.refused.to_string()),
        ("last_refusal", optional(command.last_refusal.as_ref(), |refusal| text(&refusal.to_string()))),
    ])
}

fn fault(fault: &ReportedFault) -> String {
    object(&[
        ("path", text(fault.path)),
        ("message", text(&fault.message)),
        ("count", fault.count.to_string()),
        ("first", seconds(fault.first_time)),
        ("last", seconds(fault.last_time)),
    ])
}

/// Durations in seconds; `null` if nothing was measured.
fn latency(latency: &LatencyStatistics) -> String {
    if latency.count == 0 {
        return null();
    }
    let duration = |duration: Duration| number(duration.as_secs_f64());
    object(&[
        ("count", latency.count.to_string()),
        ("median", duration(latency.median)),
        ("p99", duration(latency.p99)),
        ("p999", duration(latency.p999)),
        ("longest", duration(latency.longest)),
    ])
}

fn seconds(time: MonotonicTime) -> String {
    number(time.seconds_since(MonotonicTime::ZERO))
}
