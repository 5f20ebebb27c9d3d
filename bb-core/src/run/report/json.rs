//! A report as JSON. Times and durations are in seconds, times on the robot's own clock; what is unknown is `null`.

use super::super::{ActuatorStatistics, SourceStatistics};
use super::{Problem, Report};
use crate::component::ExecutionInfo;
use crate::control::{CommandStatistics, ReportedFault};
use crate::message::LimitedQuantity;
use crate::node::{DropReason, EstimatorStatistics, InputStatistics, LatencyStatistics};
use crate::pubsub::TopicStatistics;
use crate::time::MonotonicTime;
use bb_message::__private::compose::{Object, object};

impl Report {
    /// One JSON object: `time`, `state`, `safety`, the `problems` with the worst first, and the lists `executions`, `topics`, `estimators`,
    /// `sources`, `actuators`, `commands` and `faults`, whose elements have a `path`. `now` is the time at which it was made, and
    /// `executions` are those of the [`Bus`](crate::Bus::executions).
    pub fn to_json(&self, now: MonotonicTime, executions: &[ExecutionInfo]) -> String {
        object(|json| {
            json.number("time", seconds(now));
            json.text("state", self.state);
            json.text("safety", &self.safety.to_string());
            json.objects("problems", &self.problems(), problem);
            json.objects("executions", executions, execution);
            json.objects("topics", &self.topics, topic);
            json.objects("estimators", &self.estimators, estimator);
            json.objects("sources", &self.sources, source);
            json.objects("actuators", &self.actuators, actuator);
            json.objects("commands", &self.commands, command);
            json.objects("faults", &self.faults, fault);
            json.count("all_faults", self.all_faults);
        })
    }
}

fn problem(problem: &Problem, json: &mut Object<'_>) {
    json.text("path", &problem.path);
    json.text("severity", problem.severity.name());
    json.optional_number("since", problem.since.map(seconds));
    json.text("reason", &problem.reason);
}

fn execution(execution: &ExecutionInfo, json: &mut Object<'_>) {
    json.count("number", execution.number);
    json.text("path", execution.path);
    json.text("caller", &execution.caller);
    json.number("started", seconds(execution.started));
    json.json("progress", execution.progress.as_deref().unwrap_or("null"));
}

fn topic(topic: &TopicStatistics, json: &mut Object<'_>) {
    json.text("path", topic.path);
    json.text("payload", topic.payload);
    json.count("published", topic.published);
    json.count("lost", topic.lost);
    json.count("subscribers", topic.subscribers as u64);
}

fn estimator(estimator: &EstimatorStatistics, json: &mut Object<'_>) {
    let last = estimator.last_transition;
    json.text("path", estimator.path);
    json.optional_text("health", estimator.health.map(|health| health.to_string()).as_deref());
    json.optional_number("since", last.map(|last| seconds(last.time)));
    json.optional_text("reason", last.map(|last| last.reason.to_string()).as_deref());
    json.optional_text("source", last.map(|last| last.source));
    json.optional_text("stopped", estimator.stopped.as_deref());
    json.count("dispatched", estimator.dispatched);
    json.count("emitted", estimator.emitted);
    json.count("diverged", estimator.diverged);
    json.count("restarts", estimator.restarts);
    json.count("transitions", estimator.transitions);
    latency("latency", &estimator.latency, json);
    json.objects("inputs", &estimator.inputs, input);
}

fn input(input: &InputStatistics, json: &mut Object<'_>) {
    json.text("name", input.name);
    json.text("source", input.source);
    json.count("received", input.received);
    json.object("dropped", |json| {
        for reason in DropReason::ALL.iter().filter(|reason| input.dropped(**reason) > 0) {
            json.count(reason.name(), input.dropped(*reason));
        }
    });
    latency("age", &input.age, json);
}

fn source(source: &SourceStatistics, json: &mut Object<'_>) {
    json.text("path", source.path);
    json.optional_text("stopped", source.stopped.as_deref());
    json.optional_number("failing_since", source.failing_since.map(seconds));
    json.count("readings", source.readings);
    json.count("skipped", source.skipped);
    json.count("restarts", source.restarts);
    json.object("counts", |json| {
        for (name, count) in &source.counts {
            json.count(name, *count);
        }
    });
}

fn actuator(actuator: &ActuatorStatistics, json: &mut Object<'_>) {
    json.text("path", actuator.path);
    json.optional_text("stopped", actuator.stopped.as_deref());
    json.count("commands", actuator.commands);
    json.count("limited", LimitedQuantity::ALL.iter().map(|quantity| actuator.limited(*quantity)).sum());
    json.count("refused", LimitedQuantity::ALL.iter().map(|quantity| actuator.refused(*quantity)).sum());
}

fn command(command: &CommandStatistics, json: &mut Object<'_>) {
    json.text("path", &format!("command/{}", command.name));
    json.count("started", command.started);
    json.count("succeeded", command.succeeded);
    json.count("failed", command.failed);
    json.count("timed_out", command.timed_out);
    json.count("cancelled", command.cancelled);
    json.count("refused", command.refused);
    json.optional_text("last_refusal", command.last_refusal.as_ref().map(|refusal| refusal.to_string()).as_deref());
}

fn fault(fault: &ReportedFault, json: &mut Object<'_>) {
    json.text("path", fault.path);
    json.text("message", &fault.message);
    json.count("count", fault.count);
    json.number("first", seconds(fault.first_time));
    json.number("last", seconds(fault.last_time));
}

/// Durations in seconds; `null` if nothing was measured.
fn latency(name: &str, latency: &LatencyStatistics, json: &mut Object<'_>) {
    if latency.count == 0 {
        return json.null(name);
    }
    json.object(name, |json| {
        json.count("count", latency.count);
        json.number("median", latency.median.as_secs_f64());
        json.number("p99", latency.p99.as_secs_f64());
        json.number("p999", latency.p999.as_secs_f64());
        json.number("longest", latency.longest.as_secs_f64());
    });
}

fn seconds(time: MonotonicTime) -> f64 {
    time.seconds_since(MonotonicTime::ZERO)
}
