//! The robot as its callers see it: what the runtime implements for the [`Bus`](super::Bus).

use super::guardian::Guardian;
use super::replacement::Replacement;
use super::shared::SharedValues;
use super::{AcceptsJson, Caller, CommandInfo, Description, DynamicExecution, ExecutionInfo, Fault, RunKind};
use crate::declaration::ParameterError;
use crate::event::{ArmError, DisarmError, ParameterValue, Safety};
use crate::joints::Joints;
use crate::message::{Frame, Origin};
use crate::pubsub::{AnyTopic, DynamicMessage, Registry};
use crate::time::{Clock, MonotonicTime};
use crate::topology::{GraphFormat, Topology};
use std::any::Any;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// The robot as a whole. In all of this, the caller has the rights that it needs.
pub(crate) trait Controls: Guardian + SafetyControls + ParameterControls + CommandControls {
    fn origin(&self) -> Origin;
    fn clock(&self) -> &Clock;
    fn kind_of_run(&self) -> RunKind;
    /// Returns whether components are to stop.
    fn is_stopping(&self) -> bool;
    fn state(&self) -> &'static str;
    fn safety(&self) -> Safety;
}

/// Arming, disarming and stopping.
pub(crate) trait SafetyControls {
    fn arm(&self, caller: &Caller) -> Result<(), ArmError>;
    /// `force` needs the right to arm, and a caller that has ended only disarms.
    fn disarm(&self, force: bool, caller: &Caller) -> Result<(), DisarmError>;
    /// Disarms the robot and stops its components, without waiting.
    fn request_stop(&self, caller: &Caller) -> Result<(), Fault>;
}

/// Parameters.
pub(crate) trait ParameterControls {
    fn parameter(&self, path: &str) -> Option<ParameterValue>;
    /// Sets all of them, or none.
    fn set_parameters(&self, changes: Vec<(String, ParameterValue)>, caller: &Caller)
    -> Result<(), ParameterError>;
}

/// Commands.
pub(crate) trait CommandControls {
    fn commands(&self) -> Vec<CommandInfo>;
    /// Starts the command at `path` with arguments from JSON, on behalf of the caller.
    fn start_command(&self, path: &str, arguments: &str, caller: &Caller) -> Result<DynamicExecution, Fault>;
    /// The executions that have not ended, in the order of their numbers.
    fn executions(&self) -> Vec<ExecutionInfo>;
    /// Cancels the execution of that number on behalf of the caller.
    fn cancel(&self, execution: u64, caller: &Caller) -> Result<(), Fault>;
    /// The execution of that number has come so far.
    fn keep_progress(&self, execution: u64, progress: DynamicMessage);
    /// The execution of that number, whose caller it is, changes the operational state.
    fn transition(&self, execution: u64, state: &str, caller: &Caller) -> Result<(), Fault>;
}

/// A sensor whose messages other code publishes.
pub(crate) struct ExternalSensor {
    pub(crate) path: &'static str,
    pub(crate) frame: Frame,
    /// The name of its payload.
    pub(crate) payload: &'static str,
    /// A `Weak<Enter<T>>`, since a component of the robot may keep it.
    pub(crate) enter: Box<dyn Any>,
}

/// A robot with its topics and components.
pub(crate) trait Host: Send + Sync {
    fn controls(&self) -> &dyn Controls;
    fn joints(&self) -> Joints;
    fn topology(&self) -> &'static Topology;
    /// Values shared by the components of this run.
    fn shared(&self) -> &SharedValues;
    /// The replacement of the component at `path`, if there is one.
    fn replacement(&self, path: &str) -> Option<Replacement>;
    /// The declared topics.
    fn with_topics(&self, call: &mut dyn FnMut(&[&dyn AnyTopic]));
    /// The topics created at run time.
    fn registry(&self) -> &Registry;
    /// Returns whether there is a journal.
    fn is_journaled(&self) -> bool;
    /// Calls `publish` unless the robot has stopped; first waits while too many entries are queued for the journal's
    /// sink.
    fn while_open(&self, publish: &mut dyn FnMut());
    /// Something may be published at a path of one's own.
    fn note_path(&self, path: &'static str, payload: &'static str);
    /// The number of the entrance through which was published last at `path`, if there is a journal.
    fn last_entrance(&self, path: &'static str) -> Option<Arc<AtomicU64>>;
    /// A caller publishes at `path` through that entrance: a line of the journal, if the caller before it was another.
    fn note_caller(&self, path: &'static str, entrance: u64, caller: &str);
    /// A message is published at a path of one's own.
    fn note_own(&self, message: DynamicMessage, now: MonotonicTime);
    /// The sensor at `path`, if other code publishes its messages.
    fn external(&self, path: &str) -> Option<ExternalSensor>;
    /// The paths of those sensors.
    fn externals(&self) -> Vec<&'static str>;
    /// Publishes a message at the path of such a sensor, if it has its payload, and runs everything downstream.
    fn enter(&self, message: &DynamicMessage, now: MonotonicTime);
    /// The inputs at `path`, each as its estimator and its name.
    fn takers(&self, path: &str) -> Vec<(&'static str, &'static str)>;
    /// The actuator at `path`: the name of the type of its commands, and an `Arc<dyn Accepts<T>>`.
    fn actuator(&self, path: &str) -> Option<(&'static str, Box<dyn Any>)>;
    /// The paths of all actuators, each with its joint.
    fn actuators(&self) -> Vec<(&'static str, &'static str)>;
    fn description(&self) -> Description;
    /// The report of the run so far as JSON; `None` before the robot has started.
    fn report_json(&self) -> Option<String>;
    /// The actuator at `path`, for commands in JSON.
    fn json_actuator(&self, path: &str) -> Option<Arc<dyn AcceptsJson>>;
    fn graph(&self, format: GraphFormat) -> String;
    /// Runs disarm callbacks left by an actuator's own code, and hands lines of the journal to its sink: after a call from outside, on
    /// virtual time.
    fn settle(&self);
}

impl fmt::Debug for dyn Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Host").field(&self.controls().origin().robot).finish()
    }
}
