//! The statistics of a run: messages published per topic, and messages dropped, with reasons.

mod json;
mod problems;

pub use problems::{Problem, Severity};

use super::SourceStatistics;
use super::actuator::ActuatorStatistics;
use crate::control::{CommandStatistics, ReportedFault, ReportedSafetyError};
use crate::event::{ComponentFault, Safety};
use crate::joints::{JointRefusal, JointStatistics};
use crate::message::LimitedQuantity;
use crate::node::{DropReason, EstimatorStatistics};
use crate::pubsub::TopicStatistics;
use std::fmt;

/// Counts since the start. `Display` prints them as a table.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// Every publisher.
    pub topics: Vec<TopicStatistics>,
    /// Every estimator.
    pub estimators: Vec<EstimatorStatistics>,
    /// Every sensor and service.
    pub sources: Vec<SourceStatistics>,
    /// Every actuator.
    pub actuators: Vec<ActuatorStatistics>,
    /// Every command.
    pub commands: Vec<CommandStatistics>,
    /// Every moving joint, and unknown joint names that messages gave.
    pub joints: Vec<JointStatistics>,
    /// The operational state.
    pub state: &'static str,
    /// The safety state.
    pub safety: Safety,
    /// Components that have failed: the newest 256 faults, in the order in which they occurred last. A fault that a component
    /// repeats is listed once, with its count.
    pub faults: Vec<ReportedFault>,
    /// Number of faults, with those that were repeated.
    pub all_faults: u64,
    /// Errors that have made the safety state `error`, by component and kind: at most 256.
    pub safety_errors: Vec<ReportedSafetyError>,
    /// Panics of code that no component is charged with. Each is logged as well.
    pub panics: Panics,
}

/// Numbers of panics of code that the robot calls beside its components, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Panics {
    /// Wakers of subscriptions, of commands' results and of commands.
    pub wakers: u64,
    /// Loggers, when they were given the lines of health, safety, faults and refusals.
    pub loggers: u64,
    /// Handlers of telemetry.
    pub telemetry: u64,
    /// The sink of the journal.
    pub journal: u64,
}

impl Report {
    /// The publisher of that path.
    pub fn topic(&self, path: &str) -> Option<&TopicStatistics> {
        self.topics.iter().find(|topic| topic.path == path)
    }

    /// The estimator of that path.
    pub fn estimator(&self, path: &str) -> Option<&EstimatorStatistics> {
        self.estimators.iter().find(|estimator| estimator.path == path)
    }

    /// The sensor, controller or bridge of that path.
    pub fn source(&self, path: &str) -> Option<&SourceStatistics> {
        self.sources.iter().find(|source| source.path == path)
    }

    /// The actuator of that path.
    pub fn actuator(&self, path: &str) -> Option<&ActuatorStatistics> {
        self.actuators.iter().find(|actuator| actuator.path == path)
    }

    pub(super) fn add_fault(&mut self, fault: ReportedFault) {
        self.faults.push(fault);
        self.all_faults += 1;
    }

    /// Returns this report, if no component has failed.
    ///
    /// # Errors
    /// Of the faults that are kept, the one that occurred first.
    pub fn ok(self) -> Result<Self, ComponentFault> {
        match self.faults.iter().min_by_key(|fault| fault.first_time) {
            Some(fault) => Err(fault.clone().into()),
            None => Ok(self),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let paths = self.topics.iter().map(|topic| topic.path.len()).max().unwrap_or(0).max("path".len());
        let payloads = self.topics.iter().map(|topic| topic.payload.len()).max().unwrap_or(0).max("payload".len());
        writeln!(f, "{:paths$}  {:payloads$}  {:>9}", "path", "payload", "published")?;
        for topic in &self.topics {
            writeln!(f, "{:paths$}  {:payloads$}  {:>9}", topic.path, topic.payload, topic.published)?;
        }
        for topic in self.topics.iter().filter(|topic| topic.lost > 0) {
            writeln!(f, "{}: {} lost by slow subscribers", topic.path, topic.lost)?;
        }
        for estimator in &self.estimators {
            if let Some(reason) = estimator.last_divergence {
                writeln!(f, "{}: diverged {} times, last: {reason}", estimator.path, estimator.diverged)?;
            }
            if let Some(gap) = &estimator.last_gap {
                writeln!(f, "{}: a transform was missing, last: {gap}", estimator.path)?;
            }
            for input in &estimator.inputs {
                for reason in DropReason::ALL.iter().copied().filter(|reason| input.dropped(*reason) > 0) {
                    let (path, name, dropped) = (estimator.path, input.name, input.dropped(reason));
                    writeln!(f, "{path}: {dropped} dropped for `{name}`: {}", reason.name())?;
                }
            }
        }
        for estimator in &self.estimators {
            let (path, transitions, restarts) = (estimator.path, estimator.transitions, estimator.restarts);
            match estimator.health {
                None => writeln!(f, "{path}: left out: {}", estimator.stopped.as_deref().unwrap_or_default())?,
                Some(health) if transitions > 0 => {
                    writeln!(f, "{path}: {health} after {transitions} changes of health, {restarts} restarts")?;
                }
                Some(_) => {}
            }
        }
        for source in self.sources.iter().filter(|source| source.skipped > 0) {
            writeln!(f, "{}: {} readings, {} skipped", source.path, source.readings, source.skipped)?;
        }
        for source in &self.sources {
            for (name, count) in source.counts.iter().filter(|(_, count)| *count > 0) {
                writeln!(f, "{}: {name} {count} times", source.path)?;
            }
        }
        let has_exceeded = |actuator: &&ActuatorStatistics| {
            let mut quantities = LimitedQuantity::ALL.iter().copied();
            quantities.any(|quantity| actuator.limited(quantity) + actuator.refused(quantity) > 0)
        };
        for actuator in self.actuators.iter().filter(has_exceeded) {
            writeln!(f, "{actuator}")?;
        }
        for command in &self.commands {
            if let Some(refusal) = &command.last_refusal {
                writeln!(f, "{} times refused, last: {refusal}", command.refused)?;
            }
        }
        let is_bad = |joint: &&JointStatistics| {
            !joint.is_declared || JointRefusal::ALL.iter().any(|reason| joint.refused(*reason) > 0)
        };
        for joint in self.joints.iter().filter(is_bad) {
            writeln!(f, "{joint}")?;
        }
        for fault in &self.faults {
            writeln!(f, "{fault}")?;
        }
        for error in &self.safety_errors {
            writeln!(f, "{error}")?;
        }
        let Panics { wakers, loggers, telemetry, journal } = self.panics;
        let kinds = [
            ("wakers", wakers),
            ("loggers", loggers),
            ("telemetry handlers", telemetry),
            ("the journal's sink", journal),
        ];
        for (kind, panics) in kinds.into_iter().filter(|(_, panics)| *panics > 0) {
            writeln!(f, "{kind}: {panics} panics")?;
        }
        Ok(())
    }
}
