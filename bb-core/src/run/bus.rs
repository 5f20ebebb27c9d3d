//! The robot by path, for those who do not know its type: controllers, bridges, dashboards.

use super::Robot;
use super::actuator::{Accepts, ActuatorError, AnyActuator};
use crate::component::Fault;
use crate::control::{Control, ParameterError, ParameterValue};
use crate::message::Payload;
use crate::pubsub::{
    AnyTopic, DynamicSubscription, Overflow, Payloads, Publisher, Registry, Select, SubscriberStatistics,
    Subscription, Topic, nearest_path, unmatched_at,
};
use crate::time::Clock;
use std::fmt;
use std::sync::{Arc, Weak};

/// Where topics and actuators are.
pub(crate) trait Directory: Send + Sync {
    fn with_topics(&self, call: &mut dyn FnMut(Vec<&dyn AnyTopic>));
    fn with_actuators(&self, call: &mut dyn FnMut(Vec<&dyn AnyActuator>));
}

impl fmt::Debug for dyn Directory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Directory")
    }
}

/// The wiring of a robot `R`. Weak, since whoever has a bus may be a part of the wiring.
pub(super) struct Wired<R: Robot>(pub(super) Weak<R::Wiring>);

impl<R: Robot> Directory for Wired<R> {
    fn with_topics(&self, call: &mut dyn FnMut(Vec<&dyn AnyTopic>)) {
        if let Some(wiring) = self.0.upgrade() {
            let mut topics = R::all_topics(R::wired_topics(&wiring));
            topics.extend(R::all_actuators(&wiring).into_iter().map(|actuator| actuator.any_topic()));
            call(topics);
        }
    }

    fn with_actuators(&self, call: &mut dyn FnMut(Vec<&dyn AnyActuator>)) {
        if let Some(wiring) = self.0.upgrade() {
            call(R::all_actuators(&wiring));
        }
    }
}

/// Topics, actuators, parameters and states, by path. Clones are the same.
#[derive(Clone)]
pub struct Bus {
    control: Control,
}

impl Bus {
    pub(crate) fn new(control: Control) -> Self {
        Self { control }
    }

    /// Subscribes to what is published at `path`.
    ///
    /// # Errors
    /// Nothing is published there, or another payload; the nearest path is named.
    pub fn subscribe<T: Payload>(&self, path: &str, overflow: Overflow) -> Result<Subscription<T>, Fault> {
        self.with_topics(|topics| {
            let Some(topic) = topics.iter().find(|topic| topic.path() == path) else {
                return Err(unmatched_at(path, topics, self.registry().declared()).into());
            };
            let typed = topic.as_any().downcast_ref::<Topic<T>>().ok_or_else(|| {
                Fault::new(format!("`{path}` publishes `{}`, not `{}`", topic.payload_name(), T::NAME))
            })?;
            Ok(typed.subscribe(overflow))
        })
    }

    /// Subscribes to messages of any payload; with names of payload types, to those only.
    pub fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        overflow: Overflow,
    ) -> DynamicSubscription {
        let payloads = payloads.into();
        self.with_declared_topics(|topics| self.registry().subscribe(topics, select, &payloads, overflow))
    }

    /// A publisher at a path of the caller's own, such as `mission/progress`: names of letters, digits, `_`, `-` and `.` with
    /// `/` between them. Those who subscribed to everything, or to a subtree with this path, receive what it publishes
    /// without doing anything. A second publisher at the same path shares it.
    ///
    /// Paths are for names that recur: a robot has at most 1024 of them, of which those that nobody uses any more make room.
    ///
    /// # Errors
    /// The path is that of a declared publisher or of a topic that every robot has, it has another payload already, it is
    /// malformed, too many are in use, or the robot has stopped.
    pub fn publisher<T: Payload>(&self, path: &str) -> Result<Publisher<T>, Fault> {
        let topic = self.registry().topic(path)?;
        let control = self.control.clone();
        Ok(Publisher::new(topic, move || control.stamp()))
    }

    /// All paths that are published at.
    pub fn paths(&self) -> Vec<&'static str> {
        self.with_topics(|topics| topics.iter().map(|topic| topic.path()).collect())
    }

    /// Who listens at `path`; nobody where nothing is published.
    pub fn subscribers(&self, path: &str) -> Vec<SubscriberStatistics> {
        self.with_topics(|topics| {
            topics.iter().find(|topic| topic.path() == path).map_or_else(Vec::new, |topic| topic.subscribers())
        })
    }

    /// The actuator at `path`, which takes commands of type `T`.
    ///
    /// # Errors
    /// No actuator is there, or one that takes other commands.
    pub fn actuator<T: Payload>(&self, path: &str) -> Result<ActuatorLink<T>, Fault> {
        let mut found = Err(Fault::new(format!("no actuator is at `{path}`")));
        if let Some(directory) = self.control.directory() {
            directory.with_actuators(&mut |actuators| {
                let Some(actuator) = actuators.iter().find(|actuator| actuator.path() == path) else {
                    if let Some(near) = nearest_path(path, actuators.iter().map(|actuator| actuator.path())) {
                        found = Err(Fault::new(format!("no actuator is at `{path}`; did you mean `{near}`?")));
                    }
                    return;
                };
                found = match actuator.accepts().downcast::<Arc<dyn Accepts<T>>>() {
                    Ok(link) => Ok(ActuatorLink(*link)),
                    Err(_) => {
                        let takes = actuator.command_name();
                        Err(Fault::new(format!("`{path}` takes commands of type `{takes}`, not `{}`", T::NAME)))
                    }
                };
            });
        }
        found
    }

    /// The value of the parameter at `path`.
    pub fn parameter(&self, path: &str) -> Option<ParameterValue> {
        self.control.parameter_at(path)
    }

    /// Sets the parameter at `path`.
    ///
    /// # Errors
    /// What was expected.
    pub fn set_parameter(&self, path: &str, value: impl Into<ParameterValue>) -> Result<(), ParameterError> {
        self.control.set_parameter_at(path, value.into(), self.control.setter())
    }

    /// The operational state.
    pub fn state(&self) -> &'static str {
        self.control.state()
    }

    /// The clock of the run.
    pub fn clock(&self) -> &Clock {
        self.control.clock()
    }

    fn registry(&self) -> &Registry {
        &self.control.topics().registry
    }

    fn with_topics<T>(&self, call: impl Fn(&[&dyn AnyTopic]) -> T) -> T {
        let made = self.registry().topics();
        self.with_declared_topics(|topics| {
            let mut all: Vec<&dyn AnyTopic> = topics.to_vec();
            all.extend(made.iter().map(|topic| &**topic));
            call(&all)
        })
    }

    /// Without those made at run time.
    fn with_declared_topics<T>(&self, call: impl Fn(&[&dyn AnyTopic]) -> T) -> T {
        let system = self.control.topics().all();
        let mut result = None;
        if let Some(directory) = self.control.directory() {
            directory.with_topics(&mut |topics| {
                let all: Vec<_> = topics.into_iter().chain(system.iter().copied()).collect();
                result = Some(call(&all));
            });
        }
        // Before the robot is wired, and after it is gone.
        result.unwrap_or_else(|| call(&system))
    }
}

impl fmt::Debug for Bus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bus").finish_non_exhaustive()
    }
}

/// Sends commands of type `T` to one actuator.
pub struct ActuatorLink<T: Payload>(Arc<dyn Accepts<T>>);

impl<T: Payload> ActuatorLink<T> {
    /// Sends a command; it has been carried out when this returns.
    ///
    /// # Errors
    /// The robot is not armed, the command holds a NaN, or the actuator has failed.
    pub fn send(&self, command: T) -> Result<(), ActuatorError> {
        self.0.accept(command)
    }
}

impl<T: Payload> fmt::Debug for ActuatorLink<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ActuatorLink").finish_non_exhaustive()
    }
}
