//! A report as metrics, one family after the other: the text format requires each family to be contiguous.

use bb_core::event::SafetyError;
use bb_core::pubsub::TopicStatistics;
use bb_core::run::CommandStatistics;
use bb_core::run::SourceStatistics;
use bb_core::run::{DropReason, EstimatorStatistics, LatencyStatistics};
use bb_core::{HealthState, Live, Report, Robot, Safety};
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, MetricEncoder, NoLabelSet};
use prometheus_client::metrics::MetricType;
use prometheus_client::registry::Unit;
use std::fmt;

/// The states that every robot has.
const BUILT_IN_STATES: [&str; 3] = ["disarmed", "idle", "executing"];

/// Creates a report at each scrape.
pub(crate) struct Counts<R: Robot>(pub(crate) Live<R>);

impl<R: Robot> fmt::Debug for Counts<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Counts").field(&self.0).finish()
    }
}

impl<R: Robot> Collector for Counts<R> {
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut report = self.0.report();
        // One that was left out is not part of the robot.
        report.estimators.retain(|estimator| estimator.health.is_some());
        let mut families = Families(encoder);
        inputs(&mut families, &report.estimators)?;
        estimators(&mut families, &report.estimators)?;
        latencies(&mut families, &report.estimators)?;
        sources(&mut families, &report.sources)?;
        topics(&mut families, &report.topics)?;
        commands(&mut families, &report.commands)?;
        robot(&mut families, &report, R::STATES)
    }
}

fn inputs(families: &mut Families<'_>, estimators: &[EstimatorStatistics]) -> fmt::Result {
    let inputs =
        || estimators.iter().flat_map(|estimator| estimator.inputs.iter().map(|input| (estimator.path, input)));
    families.counter(
        "estimator_messages_received",
        "Messages that arrived, the dropped ones included",
        |family| {
            inputs().try_for_each(|(path, input)| {
                family.count(&[("estimator", path), ("input", input.name)], input.received)
            })
        },
    )?;
    families.counter("estimator_messages_dropped", "Messages that were dropped", |family| {
        for (path, input) in inputs() {
            for &reason in DropReason::ALL {
                let labels = [("estimator", path), ("input", input.name), ("reason", reason_label(reason))];
                family.count(&labels, input.dropped(reason))?;
            }
        }
        Ok(())
    })
}

fn estimators(families: &mut Families<'_>, estimators: &[EstimatorStatistics]) -> fmt::Result {
    type Count = fn(&EstimatorStatistics) -> u64;
    let counters: [(&str, &str, Count); 5] = [
        ("estimator_dispatches", "Calls of the estimator", |estimator| estimator.dispatched),
        ("estimator_emissions", "Calls in which it emitted", |estimator| estimator.emitted),
        ("estimator_divergences", "Times it said that it has diverged", |estimator| estimator.diverged),
        ("estimator_restarts", "Times it was restarted", |estimator| estimator.restarts),
        ("estimator_health_transitions", "Changes of its health", |estimator| estimator.transitions),
    ];
    for (name, help, count) in counters {
        families.counter(name, help, |family| {
            estimators
                .iter()
                .try_for_each(|estimator| family.count(&[("estimator", estimator.path)], count(estimator)))
        })?;
    }
    families.gauge("estimator_health", "1 for the state of its health", None, |family| {
        for estimator in estimators {
            for state in [HealthState::Healthy, HealthState::Degraded, HealthState::Lost] {
                let labels = [("estimator", estimator.path), ("state", &state.to_string())];
                family.gauge(&labels, one_if(estimator.health == Some(state)))?;
            }
        }
        Ok(())
    })?;
    families.gauge("estimator_running", "0 if it has stopped or waits for its restart", None, |family| {
        estimators.iter().try_for_each(|estimator| {
            family.gauge(&[("estimator", estimator.path)], one_if(estimator.stopped.is_none()))
        })
    })
}

fn latencies(families: &mut Families<'_>, estimators: &[EstimatorStatistics]) -> fmt::Result {
    families.counter("estimator_latencies", "Callbacks that were measured", |family| {
        estimators
            .iter()
            .try_for_each(|estimator| family.count(&[("estimator", estimator.path)], estimator.latency.count))
    })?;
    families.gauge("estimator_latency", "Time in callbacks since the start", Some(Unit::Seconds), |family| {
        estimators
            .iter()
            .try_for_each(|estimator| family.quantiles(&[("estimator", estimator.path)], &estimator.latency))
    })?;
    let help = "Age of the driver's messages when the callback returned, since the start";
    families.gauge("estimator_input_age", help, Some(Unit::Seconds), |family| {
        for estimator in estimators {
            for input in &estimator.inputs {
                family.quantiles(&[("estimator", estimator.path), ("input", input.name)], &input.age)?;
            }
        }
        Ok(())
    })
}

fn sources(families: &mut Families<'_>, sources: &[SourceStatistics]) -> fmt::Result {
    type Count = fn(&SourceStatistics) -> u64;
    let counters: [(&str, &str, Count); 3] = [
        ("source_readings", "Readings of a sensor, updates of a service", |source| source.readings),
        ("source_readings_skipped", "Readings at its rate for which it came too late", |source| source.skipped),
        ("source_restarts", "Times it was restarted", |source| source.restarts),
    ];
    for (name, help, count) in counters {
        families.counter(name, help, |family| {
            sources.iter().try_for_each(|source| family.count(&[("source", source.path)], count(source)))
        })?;
    }
    families.counter("source_events", "What a sensor or a service counts itself", |family| {
        for source in sources {
            for (event, count) in &source.counts {
                family.count(&[("source", source.path), ("event", event)], *count)?;
            }
        }
        Ok(())
    })?;
    families.gauge("source_running", "0 if it has stopped or waits for its restart", None, |family| {
        sources
            .iter()
            .try_for_each(|source| family.gauge(&[("source", source.path)], one_if(source.stopped.is_none())))
    })
}

fn topics(families: &mut Families<'_>, topics: &[TopicStatistics]) -> fmt::Result {
    let labels = |topic: &TopicStatistics| [("topic", topic.path), ("payload", topic.payload)];
    families.counter("topic_messages_published", "Messages published", |family| {
        topics.iter().try_for_each(|topic| family.count(&labels(topic), topic.published))
    })?;
    families.counter("topic_messages_lost", "Messages that slow subscribers lost", |family| {
        topics.iter().try_for_each(|topic| family.count(&labels(topic), topic.lost))
    })?;
    families.gauge("topic_subscribers", "Subscriptions that listen now", None, |family| {
        topics.iter().try_for_each(|topic| family.gauge(&labels(topic), topic.subscribers as f64))
    })
}

fn commands(families: &mut Families<'_>, commands: &[CommandStatistics]) -> fmt::Result {
    families.counter("command_starts", "Times the command was started", |family| {
        commands.iter().try_for_each(|command| family.count(&[("command", command.name)], command.started))
    })?;
    families.counter("command_ends", "Times the command ended, and how", |family| {
        for command in commands {
            for (outcome, count) in [
                ("succeeded", command.succeeded),
                ("failed", command.failed),
                ("timed_out", command.timed_out),
                ("cancelled", command.cancelled),
            ] {
                family.count(&[("command", command.name), ("outcome", outcome)], count)?;
            }
        }
        Ok(())
    })?;
    families.counter("command_refusals", "Times the command was refused", |family| {
        commands.iter().try_for_each(|command| family.count(&[("command", command.name)], command.refused))
    })
}

fn robot(families: &mut Families<'_>, report: &Report, declared_states: &[&str]) -> fmt::Result {
    families.gauge("safety_state", "1 for the safety state", None, |family| {
        [Safety::Disarmed, Safety::Armed, Safety::Disarming, Safety::Error]
            .into_iter()
            .try_for_each(|state| family.gauge(&[("state", &state.to_string())], one_if(report.safety == state)))
    })?;
    families.gauge("operational_state", "1 for the operational state", None, |family| {
        BUILT_IN_STATES
            .iter()
            .chain(declared_states)
            .try_for_each(|state| family.gauge(&[("state", state)], one_if(report.state == *state)))
    })?;
    families.counter("faults", "Faults of components", |family| family.count(&[], report.all_faults))?;
    families.counter("safety_errors", "Errors that made the safety state `error`", |family| {
        report.safety_errors.iter().try_for_each(|reported| {
            let SafetyError { path, error } = &reported.last;
            family.count(&[("component", path), ("kind", error.kind.name())], reported.count)
        })
    })?;
    families.counter("panics", "Panics of code that no component is charged with", |family| {
        let panics = report.panics;
        let kinds = [
            ("wakers", panics.wakers),
            ("loggers", panics.loggers),
            ("telemetry", panics.telemetry),
            ("journal", panics.journal),
        ];
        kinds.into_iter().try_for_each(|(kind, count)| family.count(&[("kind", kind)], count))
    })
}

fn one_if(condition: bool) -> f64 {
    f64::from(u8::from(condition))
}

/// A reason as a label: `inbox_full`.
fn reason_label(reason: DropReason) -> &'static str {
    match reason {
        DropReason::SyncMiss => "sync_miss",
        DropReason::OutOfOrder => "out_of_order",
        DropReason::NonFinite => "non_finite",
        DropReason::ClockSkew => "clock_skew",
        DropReason::Stopped => "stopped",
        DropReason::Overflow => "inbox_full",
        DropReason::NoTransform => "no_transform",
        // A reason added after this version of the crate.
        _ => reason.name(),
    }
}

type Label<'a> = (&'static str, &'a str);

/// Writes families of metrics.
struct Families<'a>(DescriptorEncoder<'a>);

impl Families<'_> {
    /// `name` without its prefix and without `_total`.
    fn counter(
        &mut self,
        name: &str,
        help: &str,
        members: impl FnOnce(&mut Family<'_>) -> fmt::Result,
    ) -> fmt::Result {
        members(&mut Family(self.0.encode_descriptor(name, help, None, MetricType::Counter)?))
    }

    /// `name` without its prefix and without its unit.
    fn gauge(
        &mut self,
        name: &str,
        help: &str,
        unit: Option<Unit>,
        members: impl FnOnce(&mut Family<'_>) -> fmt::Result,
    ) -> fmt::Result {
        members(&mut Family(self.0.encode_descriptor(name, help, unit.as_ref(), MetricType::Gauge)?))
    }
}

/// Writes the samples of a family.
struct Family<'a>(MetricEncoder<'a>);

impl Family<'_> {
    fn count(&mut self, labels: &[Label<'_>], value: u64) -> fmt::Result {
        self.0.encode_family(&labels)?.encode_counter::<NoLabelSet, _, u64>(&value, None)
    }

    fn gauge(&mut self, labels: &[Label<'_>], value: f64) -> fmt::Result {
        self.0.encode_family(&labels)?.encode_gauge(&value)
    }

    /// Empty if nothing was measured.
    fn quantiles(&mut self, labels: &[Label<'_>], measured: &LatencyStatistics) -> fmt::Result {
        let quantiles =
            [("0.5", measured.median), ("0.99", measured.p99), ("0.999", measured.p999), ("1", measured.longest)];
        for (quantile, duration) in quantiles.iter().filter(|_| measured.count > 0) {
            let labels: Vec<Label<'_>> = labels.iter().copied().chain([("quantile", *quantile)]).collect();
            self.gauge(&labels, duration.as_secs_f64())?;
        }
        Ok(())
    }
}
