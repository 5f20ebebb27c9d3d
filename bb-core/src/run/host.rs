//! The robot as its components see it, and the destination of entries for its estimators.

use super::actuator::AnyActuator;
use super::discovery::discover;
use super::wired::{Place, Wired as WiredRobot};
use crate::component::replacement::{Replacement, Replacements};
use crate::component::shared::SharedValues;
use crate::component::{CommandInfo, Description, DisarmHook, DynamicExecution, Guardian, Host, Permit};
use crate::control::{Control, Islands, Wired};
use crate::declaration::{ParameterError, RobotDeclaration, graph};
use crate::event::{ArmError, DisarmError, ParameterValue, Safety};
use crate::fault::Fault;
use crate::joints::Joints;
use crate::journal::{Event, Journal, Recorded};
use crate::message::Origin;
use crate::node::{NodeEntry, Overseer};
use crate::pubsub::{AnyTopic, DynamicMessage, PathChange, Registry};
use crate::schedule::Door;
use crate::time::{Clock, MonotonicTime};
use crate::topology::{GraphFormat, Topology};
use std::any::Any;
use std::sync::Arc;

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
}

impl RobotHost {
    fn wired(&self) -> Option<Arc<WiredRobot>> {
        self.wired.get()?.upgrade()
    }

    fn is_replaced(&self, path: &str) -> bool {
        self.replacements.contains_key(path)
    }

    /// Writes a line, if there is a journal.
    fn note(&self, line: impl FnOnce() -> Event) {
        if let Some(journal) = &self.journal {
            let clock = self.control.clock();
            journal.write(clock.now(), clock.wall_offset_nanos(), line());
        }
    }
}

impl Guardian for RobotHost {
    fn on_disarm(&self, path: &'static str, execution: Option<u64>, hook: DisarmHook) {
        self.control.on_disarm(path, execution, hook);
    }

    fn hardware_error(&self, path: &'static str, message: String) {
        Guardian::hardware_error(&self.control, path, message);
    }
}

impl Host for RobotHost {
    fn origin(&self) -> Origin {
        self.control.origin()
    }

    fn clock(&self) -> &Clock {
        self.control.clock()
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

    fn is_stopping(&self) -> bool {
        self.control.stop_signal().is_set()
    }

    fn state(&self) -> &'static str {
        self.control.state()
    }

    fn safety(&self) -> Safety {
        self.control.safety()
    }

    fn arm(&self, permit: &Permit) -> Result<(), ArmError> {
        self.control.arm(permit)
    }

    fn disarm(&self) -> Result<(), DisarmError> {
        self.control.disarm(false)
    }

    fn parameter(&self, path: &str) -> Option<ParameterValue> {
        self.control.parameter_at(path)
    }

    fn set_parameters(
        &self,
        changes: Vec<(String, ParameterValue)>,
        permit: &Permit,
    ) -> Result<(), ParameterError> {
        self.control.set_parameters_at(changes, permit)
    }

    fn with_topics(&self, call: &mut dyn FnMut(&[&dyn AnyTopic])) {
        let system = self.control.topics().all();
        // Before the robot is wired, and after it is gone, there are only the system's topics.
        let Some(wired) = self.wired() else { return call(&system) };
        let mut topics = wired.topics();
        topics.extend(wired.actuators().into_iter().map(|actuator| actuator.any_topic()));
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

    fn note_path(&self, change: PathChange) {
        self.note(|| match change {
            PathChange::Made { path, payload } => Event::OwnPublisher { path, payload },
            PathChange::Evicted { path } => Event::OwnPublisher { path, payload: "" },
        });
    }

    fn note_own(&self, message: DynamicMessage) {
        self.note(|| Event::Own { path: message.path(), message: Recorded::Message(message) });
    }

    fn message_failed(&self, path: &'static str, fault: Fault) {
        Overseer::message_failed(&self.control, path, format!("its message {fault}"));
    }

    fn actuator(&self, path: &str) -> Option<(&'static str, Box<dyn Any>)> {
        let wired = self.wired()?;
        let actuators = wired.actuators();
        let actuator: &&dyn AnyActuator = actuators.iter().find(|actuator| actuator.path() == path)?;
        Some((actuator.command_name(), actuator.accepts()))
    }

    fn actuators(&self) -> Vec<&'static str> {
        self.robot.actuators.iter().map(|declared| declared.path).collect()
    }

    fn actuated_joints(&self) -> Vec<(&'static str, &'static str)> {
        self.robot.actuators.iter().map(|declared| (declared.path, declared.joint)).collect()
    }

    fn commands(&self) -> Vec<CommandInfo> {
        self.control.infos()
    }

    fn description(&self) -> Description {
        let mut description = None;
        self.with_topics(&mut |topics| {
            let mut all = topics.to_vec();
            let own = self.registry().topics();
            all.extend(own.iter().map(|topic| topic.as_ref()));
            let values = self.control.parameters();
            description =
                Some(discover(self.robot, &all, values.all(), self.commands(), &|path| self.is_replaced(path)));
        });
        description.unwrap_or_else(|| discover(self.robot, &[], &[], Vec::new(), &|_| false))
    }

    fn graph(&self, format: GraphFormat) -> String {
        graph(format, self.robot, &|path| self.is_replaced(path))
    }

    fn start_command(&self, path: &str, arguments: &str, permit: &Permit) -> Result<DynamicExecution, Fault> {
        self.control.execute_untyped(path, arguments, permit)
    }
}

/// Where entries for estimators go.
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
