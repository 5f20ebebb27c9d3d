//! The robot by path, for code that does not know its type: commands, controllers, bridges, dashboards.

use super::host::Host;
use super::{Accepts, ActuatorLink, CommandInfo, Description, DynamicExecution, Fault, Permit};
use crate::declaration::ParameterError;
use crate::event::{ArmError, DisarmError, ParameterValue, Safety};
use crate::fault::of_panic;
use crate::joints::Joints;
use crate::message::nearest::nearest_path;
use crate::message::{Panic, Payload, Stamp};
use crate::pubsub::{
    AnyTopic, DynamicMessage, DynamicSubscription, Gate, Overflow, Payloads, Publisher, Select,
    SubscriberStatistics, Subscription, Topic, unmatched_at,
};
use crate::time::Clock;
use crate::topology::{GraphFormat, Topology};
use std::fmt;
use std::sync::Arc;

/// Topics, actuators, parameters, commands and states, by path. Clones are the same.
#[derive(Clone)]
pub struct Bus {
    host: Arc<dyn Host>,
    permit: Permit,
}

impl Bus {
    pub(crate) fn new(host: Arc<dyn Host>, permit: Permit) -> Self {
        Self { host, permit }
    }

    /// Subscribes to what is published at `path`.
    ///
    /// # Errors
    /// Nothing is published there, or another payload is; the error names the nearest path.
    pub fn subscribe<T: Payload>(&self, path: &str, overflow: Overflow) -> Result<Subscription<T>, Fault> {
        let subscribed = self.with_topics(|topics| {
            let Some(topic) = topics.iter().find(|topic| topic.path() == path) else {
                return Err(unmatched_at(path, topics, self.host.registry().declared()).into());
            };
            let typed = topic.as_any().downcast_ref::<Topic<T>>().ok_or_else(|| {
                Fault::new(format!("`{path}` publishes `{}`, not `{}`", topic.payload_name(), T::NAME))
            })?;
            Ok(typed.subscribe(overflow))
        });
        subscribed.unwrap_or_else(|| Err(Fault::new("the robot is gone")))
    }

    /// Subscribes to messages of any payload; with names of payload types, only to those.
    pub fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        overflow: Overflow,
    ) -> DynamicSubscription {
        let payloads = payloads.into();
        let mut subscribed = None;
        self.host.with_topics(&mut |topics| {
            subscribed = Some(self.host.registry().subscribe(topics, select, &payloads, overflow));
        });
        subscribed.unwrap_or_else(|| DynamicSubscription::new([], select, payloads, overflow))
    }

    /// Returns a publisher at a path of the caller's choice, such as `mission/progress`: names of letters, digits,
    /// `_`, `-` and `.`, separated by `/`. Existing subscriptions to everything, or to a subtree with this path,
    /// receive its messages. A second publisher at the same path shares it.
    ///
    /// A robot has at most 1024 such paths; a new one replaces the oldest that is no longer used.
    ///
    /// # Errors
    /// The path is that of a declared publisher or of a topic that every robot has, it has another payload already, it is
    /// malformed, too many are in use, the robot has stopped, or the command that this bus belongs to has ended.
    pub fn publisher<T: Payload>(&self, path: &str) -> Result<Publisher<T>, Fault> {
        self.check_permit()?;
        let topic = self.host.registry().topic_noted::<T>(path, &mut |change| self.host.note_path(change))?;
        Ok(Publisher::new(topic, Arc::new(OwnPath { host: Arc::clone(&self.host), permit: self.permit.clone() })))
    }

    /// All paths with a publisher.
    pub fn paths(&self) -> Vec<&'static str> {
        self.with_topics(|topics| topics.iter().map(|topic| topic.path()).collect()).unwrap_or_default()
    }

    /// The subscribers at `path`; empty where nothing is published.
    pub fn subscribers(&self, path: &str) -> Vec<SubscriberStatistics> {
        self.with_topics(|topics| {
            topics.iter().find(|topic| topic.path() == path).map_or_else(Vec::new, |topic| topic.subscribers())
        })
        .unwrap_or_default()
    }

    /// The actuator at `path`, which takes commands of type `T`.
    ///
    /// # Errors
    /// No actuator is there, or one that takes other commands.
    pub fn actuator<T: Payload>(&self, path: &str) -> Result<ActuatorLink<T>, Fault> {
        let Some((takes, accepts)) = self.host.actuator(path) else {
            let near = nearest_path(path, self.host.actuators());
            let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            return Err(Fault::new(format!("no actuator is at `{path}`{hint}")));
        };
        match accepts.downcast::<Arc<dyn Accepts<T>>>() {
            Ok(accepts) => Ok(ActuatorLink::new(*accepts, self.permit.clone())),
            Err(_) => Err(Fault::new(format!("`{path}` takes commands of type `{takes}`, not `{}`", T::NAME))),
        }
    }

    /// The paths of all actuators.
    pub fn actuators(&self) -> Vec<&'static str> {
        self.host.actuators()
    }

    /// The path of the actuator that moves a joint: the first declared one if there are several, `None` if there is
    /// none.
    pub fn actuator_of(&self, joint: &str) -> Option<&'static str> {
        self.host.actuated_joints().into_iter().find(|(_, moved)| *moved == joint).map(|(path, _)| path)
    }

    /// The links and joints of the robot.
    pub fn topology(&self) -> &'static Topology {
        self.host.topology()
    }

    /// The value of the parameter at `path`.
    pub fn parameter(&self, path: &str) -> Option<ParameterValue> {
        self.host.parameter(path)
    }

    /// Sets the parameter at `path`.
    ///
    /// # Errors
    /// The value is not accepted, or the command that this bus belongs to has been cancelled.
    pub fn set_parameter(&self, path: &str, value: impl Into<ParameterValue>) -> Result<(), ParameterError> {
        self.set_parameters([(path, value.into())])
    }

    /// Sets parameters by path, all at once: nobody sees some of them with the new value and others with the old one. If one of
    /// the values is not accepted, none is set.
    ///
    /// # Errors
    /// The first value that is not accepted, or the command that this bus belongs to has been cancelled.
    pub fn set_parameters<P: Into<String>>(
        &self,
        values: impl IntoIterator<Item = (P, ParameterValue)>,
    ) -> Result<(), ParameterError> {
        let changes = values.into_iter().map(|(path, value)| (path.into(), value)).collect();
        self.host.set_parameters(changes, &self.permit)
    }

    /// The whole robot: links, joints, components, topics, parameters and commands, with their schemas.
    pub fn description(&self) -> Description {
        self.host.description()
    }

    /// The robot as a picture, like [`Robot::graph`](crate::run::Robot::graph), with replaced components marked.
    pub fn graph(&self, format: GraphFormat) -> String {
        self.host.graph(format)
    }

    /// All commands, with the shapes of their arguments and results.
    pub fn commands(&self) -> Vec<CommandInfo> {
        self.host.commands()
    }

    /// Starts the command at `path` with arguments from JSON; an empty string means the default arguments.
    ///
    /// # Errors
    /// There is no such command, the arguments do not fit its shape, or it is refused.
    pub fn start_command(&self, path: &str, arguments: &str) -> Result<DynamicExecution, Fault> {
        self.check_permit()?;
        self.host.start_command(path, arguments, &self.permit)
    }

    /// The operational state.
    pub fn state(&self) -> &'static str {
        self.host.state()
    }

    /// The safety state.
    pub fn safety(&self) -> Safety {
        self.host.safety()
    }

    /// Arms the robot. See [`Live::arm`](crate::Live::arm).
    ///
    /// # Errors
    /// Why it is not armed.
    pub fn arm(&self) -> Result<(), ArmError> {
        self.host.arm(&self.permit)
    }

    /// Disarms the robot. See [`Live::disarm`](crate::Live::disarm).
    ///
    /// # Errors
    /// Why it may not be safe.
    pub fn disarm(&self) -> Result<(), DisarmError> {
        self.host.disarm()
    }

    /// The states of the joints, and all frames at any time.
    pub fn joints(&self) -> Joints {
        self.host.joints()
    }

    /// The clock of the run.
    pub fn clock(&self) -> &Clock {
        self.host.clock()
    }

    fn check_permit(&self) -> Result<(), Fault> {
        self.permit.check()
    }

    /// All topics; none if the robot is gone.
    fn with_topics<T>(&self, call: impl FnOnce(&[&dyn AnyTopic]) -> T) -> Option<T> {
        let made = self.host.registry().topics();
        let mut call = Some(call);
        let mut result = None;
        self.host.with_topics(&mut |topics| {
            let all: Vec<&dyn AnyTopic> = topics.iter().copied().chain(made.iter().map(|topic| &**topic)).collect();
            result = call.take().map(|call| call(&all));
        });
        result
    }
}

/// Publishes at a path of the caller's choice.
struct OwnPath {
    host: Arc<dyn Host>,
    permit: Permit,
}

impl Gate for OwnPath {
    fn pass(&self, path: &'static str, publish: &mut dyn FnMut(Stamp) -> Option<Panic>) {
        self.host.while_open(&mut || {
            // After what had to be waited for.
            if !self.permit.is_valid() {
                return;
            }
            let clock = self.host.clock();
            let monotonic_time = clock.now();
            let wall_time = clock.wall_at(monotonic_time);
            let stamp = Stamp { monotonic_time, wall_time, origin: self.host.origin(), ..Stamp::default() };
            let panic = publish(stamp);
            if let Some(panic) = panic {
                self.host.message_failed(path, of_panic(panic));
            }
        });
    }

    fn is_noted(&self) -> bool {
        self.host.is_journaled()
    }

    fn note(&self, message: DynamicMessage) {
        self.host.note_own(message);
    }
}

impl fmt::Debug for Bus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bus").finish_non_exhaustive()
    }
}
