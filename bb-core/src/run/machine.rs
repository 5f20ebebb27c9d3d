//! The part that all kinds of run share: the wiring and the operations on it.

use super::actuator::AnyActuator;
use super::keeper::Keeper;
use super::source::SharedSource;
use super::wired::Wired;
use super::{Panics, Report};
use crate::component::{Bus, Fault, Host};
use crate::control::{Control, ReportedFault, Summary};
use crate::declaration::RobotDeclaration;
use crate::fault::lock;
use crate::journal::{Event, Journal};
use crate::node::{AnyIsland, CallError, Environment, NodeEntry, Visit};
use crate::pubsub::{AnyTopic, TopicStatistics};
use crate::telemetry::Telemetry;
use crate::time::MonotonicTime;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

/// A robot that has been assembled.
pub(super) struct Machine {
    pub(super) robot: &'static RobotDeclaration,
    pub(super) wired: Arc<Wired>,
    pub(super) environment: Environment,
    pub(super) control: Control,
    pub(super) host: Arc<dyn Host>,
    /// The program's.
    pub(super) bus: Bus,
    pub(super) sources: Mutex<Vec<SharedSource>>,
    /// The threads of the robot have no work left.
    pub(super) has_ended: AtomicBool,
    /// Report at the end.
    pub(super) last_report: OnceLock<Report>,
    /// Store of parameters, which is removed at the end.
    pub(super) keeper: Mutex<Option<Keeper>>,
}

/// Number of one-way requests that may wait for an estimator; further ones are refused.
const MOST_CASTS: u32 = 1024;

impl Machine {
    pub(super) fn topics(&self) -> Vec<&dyn AnyTopic> {
        self.wired.topics().into_iter().chain(self.control.topics().all()).collect()
    }

    pub(super) fn actuators(&self) -> Vec<&dyn AnyActuator> {
        self.wired.actuators()
    }

    /// Visits an estimator as a caller that waits for an answer, after the line `line` of the journal. Why it was not visited is
    /// returned.
    pub(super) fn visit(&self, estimator: usize, line: Event, visit: &mut Visit<'_>) -> Result<(), Fault> {
        let now = self.environment.clock().now();
        let declaration = self.environment.node(estimator).declaration();
        let Some(island) = self.island(declaration.island) else { return Ok(()) };
        let visited = island.visit(now, estimator, line, visit);
        let path = declaration.path;
        visited.map_err(|error| {
            Fault::new(match error {
                CallError::Busy => format!("{path} has been busy for 5 s and has not answered"),
                CallError::Inside => format!(
                    "{path} cannot be asked by code that an estimator's message has woken, which would wait for \
                     itself: use `cast`, or another thread"
                ),
            })
        })
    }

    /// Enqueues a one-way request for an estimator.
    pub(super) fn cast(&self, estimator: usize, entry: NodeEntry) -> Result<(), Fault> {
        let node = self.environment.node(estimator);
        let path = node.declaration().path;
        if let Some(stopped) = node.stopped().filter(|stopped| stopped.for_good) {
            return Err(Fault::new(format!("{path} does not run any more: {}", stopped.reason)));
        }
        if self.has_ended.load(Ordering::Acquire) {
            return Err(Fault::new(format!("{path} does not run any more")));
        }
        if !node.begin_cast(MOST_CASTS) {
            return Err(Fault::new(format!("too many requests wait for {path}")));
        }
        if let Some(island) = self.island(node.declaration().island) {
            island.post(self.environment.clock().now(), estimator, entry);
        }
        Ok(())
    }

    /// A replacement does not implement the requests of the estimator with that number.
    pub(super) fn check_requests(&self, estimator: usize) -> Result<(), Fault> {
        let path = self.environment.node(estimator).declaration().path;
        match self.environment.replacement(path) {
            Some(_) => Err(Fault::new(format!("{path} is replaced, and its replacement takes no requests"))),
            None => Ok(()),
        }
    }

    pub(super) fn shared_sources(&self) -> Vec<SharedSource> {
        lock(&self.sources).clone()
    }

    pub(super) fn islands(&self) -> impl Iterator<Item = &dyn AnyIsland> {
        self.wired.islands.iter().map(|island| &**island)
    }

    pub(super) fn island(&self, number: usize) -> Option<&dyn AnyIsland> {
        self.wired.island(number)
    }

    /// Starts all estimators.
    pub(super) fn start_islands(&self, now: MonotonicTime) {
        for island in self.islands() {
            island.start(now);
        }
    }

    /// The estimator whose callback an island runs.
    pub(super) fn path_of_busy(&self, island: &dyn AnyIsland) -> &'static str {
        let running = island.busy().and_then(|(_, estimator)| self.robot.estimators.get(estimator));
        running.map_or(island.declaration().name, |estimator| estimator.path)
    }

    /// Settles a call from outside, see [`Host::settle`].
    pub(super) fn settle(&self) {
        self.host.settle();
    }

    /// Returns whether it has given its last report.
    #[cfg(feature = "signals")]
    pub(super) fn has_ended(&self) -> bool {
        self.last_report.get().is_some()
    }

    /// The report so far; the last report once it has ended.
    pub(super) fn report(&self) -> Report {
        match self.last_report.get() {
            Some(report) => report.clone(),
            None => self.control.between_entries(|control| self.report_of(control)),
        }
    }

    pub(super) fn report_of(&self, control: Summary) -> Report {
        let topics = self.topics();
        let estimators = self.environment.nodes().iter().map(|node| node.statistics()).collect();
        let sources = lock(&self.sources);
        let mut topics: Vec<_> = topics.iter().map(|topic| topic.statistics()).collect();
        topics.extend(self.control.topics().registry.statistics());
        let panics = self.panics(&topics, &control);
        let Summary { commands, state, safety, faults, all_faults, safety_errors, .. } = control;
        Report {
            topics,
            estimators,
            sources: sources.iter().map(SharedSource::statistics).collect(),
            actuators: self.actuators().into_iter().map(|actuator| actuator.statistics()).collect(),
            commands,
            joints: self.environment.joints().statistics(),
            state,
            safety,
            faults,
            all_faults,
            safety_errors,
            panics,
        }
    }

    /// Panics of code that no component is charged with.
    pub(super) fn panics(&self, topics: &[TopicStatistics], control: &Summary) -> Panics {
        Panics {
            wakers: topics.iter().map(|topic| topic.panics).sum::<u64>() + control.waker_panics,
            loggers: control.logger_panics,
            telemetry: self.environment.telemetry().map_or(0, Telemetry::panics),
            journal: self.environment.journal().map_or(0, Journal::panics),
        }
    }

    /// Records a fault of a component that did not return.
    pub(super) fn fault(&self, path: &'static str, message: String) -> ReportedFault {
        let now = self.control.note_fault(path, message.clone());
        ReportedFault { path, message, count: 1, first_time: now, last_time: now }
    }
}
