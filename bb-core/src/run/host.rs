//! The robot as its components see it, and the destination of entries for its estimators.

use super::actuator::AnyActuator;
use super::discovery::discover;
use super::machine::Machine;
use super::wired::{Place, Wired as WiredRobot};
use crate::component::replacement::{Replacement, Replacements};
use crate::component::shared::SharedValues;
use crate::component::{AcceptsJson, Controls, Description, ExternalSensor, Host};
use crate::control::{Control, Islands, Wired};
use crate::declaration::{RobotDeclaration, graph};
use crate::fault::lock;
use crate::joints::Joints;
use crate::journal::{Event, Journal, Recorded};
use crate::node::NodeEntry;
use crate::pubsub::{AnyTopic, DynamicMessage, Registry};
use crate::schedule::Door;
use crate::time::MonotonicTime;
use crate::topology::{GraphFormat, Topology};
use bb_message::__private::Sorted;
use std::any::Any;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};

/// Weak, since components with a bus are part of the wiring.
pub(super) struct RobotHost {
    pub(super) robot: &'static RobotDeclaration,
    pub(super) control: Control,
    pub(super) journal: Option<Journal>,
    pub(super) door: Door,
    pub(super) joints: Joints,
    pub(super) shared: SharedValues,
    pub(super) replacements: Replacements,
    pub(super) wired: Place,
    /// The last caller of each path that callers publish at, for the journal.
    pub(super) callers: Mutex<Sorted<&'static str, LastCaller>>,
    /// The robot once it is assembled, for its report.
    pub(super) machine: Arc<OnceLock<Weak<Machine>>>,
}

/// The caller that has published last at a path.
#[derive(Debug, Default)]
pub(super) struct LastCaller {
    /// `None` before the first message.
    name: Option<String>,
    /// The number of its entrance; 0 for none. Entrances compare it, so that the lock is only taken where it changes.
    entrance: Arc<AtomicU64>,
}

impl RobotHost {
    fn wired(&self) -> Option<Arc<WiredRobot>> {
        self.wired.get()?.upgrade()
    }

    fn is_replaced(&self, path: &str) -> bool {
        self.replacements.get(path).is_some()
    }

    /// Writes a line, if there is a journal.
    fn note(&self, line: impl FnOnce() -> Event) {
        if let Some(journal) = &self.journal {
            let clock = self.control.clock();
            journal.write(clock.now(), clock.wall_offset_nanos(), line());
        }
    }
}

impl Host for RobotHost {
    fn controls(&self) -> &dyn Controls {
        &self.control
    }

    fn joints(&self) -> Joints {
        self.joints.clone()
    }

    fn topology(&self) -> &'static Topology {
        self.robot.topology
    }

    fn shared(&self) -> &SharedValues {
        &self.shared
    }

    fn replacement(&self, path: &str) -> Option<Replacement> {
        self.replacements.get(path).cloned()
    }

    fn with_topics(&self, call: &mut dyn FnMut(&[&dyn AnyTopic])) {
        let system = self.control.topics().all();
        // Before the robot is wired, and after it is gone, there are only the system's topics.
        let Some(wired) = self.wired() else { return call(&system) };
        let mut topics = wired.topics();
        topics.extend(system);
        call(&topics);
    }

    fn registry(&self) -> &Registry {
        &self.control.topics().registry
    }

    fn is_journaled(&self) -> bool {
        self.journal.is_some()
    }

    fn while_open(&self, publish: &mut dyn FnMut()) {
        if let Some(journal) = &self.journal {
            journal.wait_for_room();
        }
        if let Some(_inside) = self.door.enter() {
            publish();
        }
    }

    fn last_entrance(&self, path: &'static str) -> Option<Arc<AtomicU64>> {
        self.journal.as_ref()?;
        Some(Arc::clone(&lock(&self.callers).get_or_insert(path, LastCaller::default).entrance))
    }

    fn note_caller(&self, path: &'static str, entrance: u64, caller: &str) {
        // The line is written under the lock, so that lines of one path are in the order of the callers.
        let mut callers = lock(&self.callers);
        let last = callers.get_or_insert(path, LastCaller::default);
        if last.name.as_deref() != Some(caller) {
            last.name = Some(caller.to_owned());
            self.note(|| Event::Publisher { path, caller: caller.to_owned() });
        }
        last.entrance.store(entrance, Ordering::Release);
    }

    fn note_path(&self, path: &'static str, payload: &'static str) {
        self.note(|| Event::OwnPublisher { path, payload });
    }

    fn note_own(&self, message: DynamicMessage, now: MonotonicTime) {
        if let Some(journal) = &self.journal {
            let event = Event::Own { path: message.path(), message: Recorded::Message(message) };
            journal.write(now, self.control.clock().wall_offset_nanos(), event);
        }
    }

    fn external(&self, path: &str) -> Option<ExternalSensor> {
        self.wired()?.external(path)
    }

    fn externals(&self) -> Vec<&'static str> {
        self.wired().map_or_else(Vec::new, |wired| wired.externals())
    }

    fn enter(&self, message: &DynamicMessage, now: MonotonicTime) {
        if let Some(wired) = self.wired() {
            wired.enter(message, now);
        }
    }

    fn takers(&self, path: &str) -> Vec<(&'static str, &'static str)> {
        let mut takers = Vec::new();
        for declared in self.robot.estimators {
            for input in declared.inputs.iter().filter(|input| input.source == path) {
                takers.push((declared.path, input.name));
            }
        }
        takers
    }

    fn actuator(&self, path: &str) -> Option<(&'static str, Box<dyn Any>)> {
        let wired = self.wired()?;
        let actuators = wired.actuators();
        let actuator: &&dyn AnyActuator = actuators.iter().find(|actuator| actuator.path() == path)?;
        Some((actuator.command_name(), actuator.accepts()))
    }

    fn actuators(&self) -> Vec<(&'static str, &'static str)> {
        self.robot.actuators.iter().map(|declared| (declared.path, declared.joint)).collect()
    }

    fn description(&self) -> Description {
        let mut description = None;
        let wired = self.wired();
        let externals = wired.as_ref().map_or_else(Vec::new, |wired| wired.externals());
        self.with_topics(&mut |topics| {
            let mut all = topics.to_vec();
            let own = self.registry().published_topics();
            all.extend(own.iter().map(|topic| topic.as_ref()));
            let values = self.control.parameters();
            let run = self.control.kind_of_run();
            let is_external =
                |path: &str| externals.contains(&path) || own.iter().any(|topic| topic.path() == path);
            let is_replaced = |path: &str| self.is_replaced(path);
            let commands = self.controls().commands();
            description = Some(discover(self.robot, run, &all, values.all(), commands, &is_replaced, &is_external));
        });
        let empty =
            || discover(self.robot, self.control.kind_of_run(), &[], &[], Vec::new(), &|_| false, &|_| false);
        let mut description = description.unwrap_or_else(empty);
        if let Some(wired) = wired {
            let actuators = wired.actuators();
            for component in &mut description.components {
                let actuator = actuators.iter().find(|actuator| actuator.path() == component.path);
                component.command = actuator.map(|actuator| actuator.command_shape());
            }
        }
        description
    }

    fn report_json(&self) -> Option<String> {
        let machine = self.machine.get()?.upgrade()?;
        Some(machine.report().to_json(self.control.clock().now(), &self.controls().executions()))
    }

    fn json_actuator(&self, path: &str) -> Option<Arc<dyn AcceptsJson>> {
        let wired = self.wired()?;
        let accepts = wired.actuators().into_iter().find(|actuator| actuator.path() == path)?.accepts_json();
        accepts.downcast::<Arc<dyn AcceptsJson>>().ok().map(|accepts| *accepts)
    }

    fn graph(&self, format: GraphFormat) -> String {
        graph(format, self.robot, &|path| self.is_replaced(path))
    }

    fn settle(&self) {
        if !self.control.is_virtual() {
            return;
        }
        while self.control.run_pending_hooks() {}
        if let Some(journal) = &self.journal {
            journal.flush();
        }
    }
}

/// The islands, as the destination of entries for estimators.
pub(super) struct WiredIslands {
    pub(super) robot: &'static RobotDeclaration,
    pub(super) wired: Place,
}

impl Islands for WiredIslands {
    fn post(&self, estimator: usize, now: MonotonicTime, entry: NodeEntry) -> Option<Wired> {
        let wired = self.wired.get()?.upgrade()?;
        wired.island(self.robot.estimators.get(estimator)?.island)?.post(now, estimator, entry);
        Some(wired)
    }
}
