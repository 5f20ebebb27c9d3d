//! The robot by path, for code that does not know its type: commands, controllers, bridges, dashboards.

mod disarm_queue;
mod publishing;
mod session;

pub use disarm_queue::DisarmQueue;
pub use session::Session;

use super::host::{Controls, Host};
use super::{
    Accepts, ActuatorLink, Caller, CommandInfo, Description, DynamicExecution, ExecutionInfo, Fault, RunKind,
};
use crate::declaration::{ParameterError, parameter_from_json};
use crate::event::{ArmError, DisarmError, Forbidden, ParameterValue, Right, Rights, Safety};
use crate::joints::Joints;
use crate::message::Payload;
use crate::pubsub::{
    AnyTopic, Delivery, DynamicSubscription, Payloads, Select, SubscriberStatistics, Subscription, Topic,
    unmatched_at,
};
use crate::time::Clock;
use crate::topology::{GraphFormat, Topology};
use bb_message::__private::{did_you_mean, nearest_path};
use std::fmt;
use std::sync::Arc;

/// Topics, actuators, parameters, commands and states, by path, in the name of a caller and with its rights. Clones are the same.
///
/// [`Live`](crate::Live) and [`CommandContext`](crate::CommandContext) dereference to one. A program has all rights, and so have
/// components and commands; a program gives fewer to those for whom it calls, such as the users of a page:
///
/// ```
/// use bb_core::event::{Right, Rights};
/// # use bb_core::prelude::*;
/// # robot! { robot Rig; parameters { speed: f64 = 1.0; } link base; }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let rig = Rig::builder().simulate()?;
/// let page = rig.bus().for_caller("page", [Right::Read, Right::Parameters]);
/// page.set_parameter("param/speed", 2.0)?;
/// assert_eq!(page.arm().unwrap_err().to_string(), "the robot was not armed: `page` does not have the right `arm`");
/// // Everybody may disarm it.
/// rig.bus().for_caller("stop button", Rights::NONE).disarm()?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Bus {
    pub(super) host: Arc<dyn Host>,
    pub(super) caller: Caller,
}

impl Bus {
    pub(crate) fn new(host: Arc<dyn Host>, caller: Caller) -> Self {
        Self { host, caller }
    }

    /// A bus for another caller, with those of `rights` that this one has. What it obtains from its bus, such as a link to an
    /// actuator, acts in its name.
    pub fn for_caller(&self, name: impl Into<String>, rights: impl Into<Rights>) -> Self {
        Self { host: Arc::clone(&self.host), caller: self.caller.restricted(name.into(), rights.into()) }
    }

    /// A bus for another caller, with those of `rights` that this one has, until the returned session is dropped.
    pub fn session(&self, name: impl Into<String>, rights: impl Into<Rights>) -> Session {
        let caller = self.caller.restricted(name.into(), rights.into()).in_session();
        Session::new(Self { host: Arc::clone(&self.host), caller })
    }

    /// The name of the caller: the path of a component or a command, or `program`.
    pub fn caller(&self) -> &str {
        self.caller.name()
    }

    /// The rights of the caller.
    pub fn rights(&self) -> Rights {
        self.caller.rights()
    }

    /// # Errors
    /// The caller does not have the right.
    pub fn check(&self, right: Right) -> Result<(), Forbidden> {
        self.caller.check(right)
    }

    /// Subscribes to what is published at `path`. A path of your own may be subscribed to before its publisher is created; if that
    /// publishes another payload, it is refused. Because such a path may be a misspelt one, it is logged as a warning and noted in
    /// [`Subscription::unmatched`]; [`Subscription::matched`] makes it an error.
    ///
    /// # Errors
    /// Another payload is published there, the path is malformed, the robot has stopped, or the caller may not read.
    pub fn subscribe<T: Payload>(
        &self,
        path: &str,
        delivery: impl Into<Delivery>,
    ) -> Result<Subscription<T>, Fault> {
        self.check(Right::Read)?;
        let (delivery, registry) = (delivery.into(), self.host.registry());
        let mut declared = None;
        self.host.with_topics(&mut |topics| {
            declared = topics.iter().find(|topic| topic.path() == path).map(|topic| {
                let typed = topic.as_any().downcast_ref::<Topic<T>>();
                let typed = typed.map(|typed| typed.subscribe_on(delivery, registry.timer()));
                typed.ok_or_else(|| {
                    Fault::new(format!("`{path}` publishes `{}`, not `{}`", topic.payload_name(), T::NAME))
                })
            });
        });
        if let Some(declared) = declared {
            return declared;
        }
        let (topic, is_published) = registry.awaited::<T>(path)?;
        let subscription = topic.subscribe_on(delivery, registry.timer());
        if is_published {
            return Ok(subscription);
        }
        match self.with_topics(|topics| Some(unmatched_at(path, topics))) {
            Some(unmatched) => Ok(subscription.noting(unmatched)),
            None => Ok(subscription),
        }
    }

    /// Subscribes from now on to messages of any payload, by path; with names of payload types, only to those. A caller that may not
    /// read gets none.
    pub fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        delivery: impl Into<Delivery>,
    ) -> DynamicSubscription {
        let (payloads, delivery) = (payloads.into(), delivery.into());
        let mut subscribed = None;
        if self.check(Right::Read).is_err() {
            return DynamicSubscription::new([], select, payloads, delivery);
        }
        self.host.with_topics(&mut |topics| {
            subscribed = Some(self.host.registry().subscribe(topics, select, &payloads, delivery));
        });
        subscribed.unwrap_or_else(|| DynamicSubscription::new([], select, payloads, delivery))
    }

    /// All paths with a publisher.
    pub fn paths(&self) -> Vec<&'static str> {
        self.with_topics(|topics| topics.iter().map(|topic| topic.path()).collect())
    }

    /// The subscribers at `path`.
    pub fn subscribers(&self, path: &str) -> Vec<SubscriberStatistics> {
        if let Some(own) = self.host.registry().topics().iter().find(|topic| topic.path() == path) {
            return own.subscribers();
        }
        self.with_topics(|topics| {
            topics.iter().find(|topic| topic.path() == path).map_or_else(Vec::new, |topic| topic.subscribers())
        })
    }

    /// The actuator at `path`, which takes commands of type `T`.
    ///
    /// # Errors
    /// No actuator is there, or one that takes other commands, or the caller may not send to actuators.
    pub fn actuator<T: Payload>(&self, path: &str) -> Result<ActuatorLink<T>, Fault> {
        self.check(Right::Actuators)?;
        let Some((takes, accepts)) = self.host.actuator(path) else {
            return Err(self.no_actuator(path));
        };
        match accepts.downcast::<Arc<dyn Accepts<T>>>() {
            Ok(accepts) => Ok(ActuatorLink::new(*accepts, self.caller.clone())),
            Err(_) => Err(Fault::new(format!("`{path}` takes commands of type `{takes}`, not `{}`", T::NAME))),
        }
    }

    fn no_actuator(&self, path: &str) -> Fault {
        let hint = did_you_mean(nearest_path(path, self.actuators()));
        Fault::new(format!("no actuator is at `{path}`{hint}"))
    }

    /// The paths of all actuators.
    pub fn actuators(&self) -> Vec<&'static str> {
        self.host.actuators().into_iter().map(|(path, _)| path).collect()
    }

    /// The path of the actuator that moves a joint: the first declared one if there are several, `None` if there is
    /// none.
    pub fn actuator_of(&self, joint: &str) -> Option<&'static str> {
        self.host.actuators().into_iter().find(|(_, moved)| *moved == joint).map(|(path, _)| path)
    }

    /// The links and joints of the robot.
    pub fn topology(&self) -> &'static Topology {
        self.host.topology()
    }

    /// The value of the parameter at `path`; `None` also for a caller that may not read.
    pub fn parameter(&self, path: &str) -> Option<ParameterValue> {
        self.check(Right::Read).ok()?;
        self.host.controls().parameter(path)
    }

    /// Sets the parameter at `path`.
    ///
    /// # Errors
    /// The value is not accepted, the command that this bus belongs to has been cancelled, or the caller may not set parameters.
    pub fn set_parameter(&self, path: &str, value: impl Into<ParameterValue>) -> Result<(), ParameterError> {
        self.set_parameters([(path, value.into())])
    }

    /// Sets parameters all at once: no reader sees a mixture of new and old values. If one of the values
    /// is not accepted, none is set. [`ParameterHandle::to`](crate::ParameterHandle::to) checks the type of a value when it is
    /// compiled; a path may also be written as text.
    ///
    /// ```
    /// # use bb_core::prelude::*;
    /// # robot! { robot Rig; parameters { gains { kp: f64 = 1.0, range: 0.0..=10.0; ki: f64 = 0.0; } } link base; }
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let rig = Rig::builder().simulate()?;
    /// rig.set_parameters([rig::param::gains::kp.to(2.0), rig::param::gains::ki.to(0.5)])?;
    /// // The first is out of range: the second is not set either.
    /// assert!(rig.set_parameters([("param/gains/kp", 99.0.into()), ("param/gains/ki", 0.1.into())]).is_err());
    /// assert_eq!((rig.parameter(rig::param::gains::kp), rig.parameter(rig::param::gains::ki)), (2.0, 0.5));
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// The first value that is not accepted: no such parameter, another type, out of its range, refused by a component that is
    /// bound to it, or set twice. Or the command that this bus belongs to has been cancelled, or the caller may not set
    /// parameters.
    pub fn set_parameters<P: Into<String>>(
        &self,
        values: impl IntoIterator<Item = (P, ParameterValue)>,
    ) -> Result<(), ParameterError> {
        self.set_all(values.into_iter().map(|(path, value)| (path.into(), value)).collect())
    }

    fn set_all(&self, changes: Vec<(String, ParameterValue)>) -> Result<(), ParameterError> {
        if let Err(forbidden) = self.check(Right::Parameters) {
            let path = changes.into_iter().next().map_or_else(String::new, |(path, _)| path);
            return Err(ParameterError { path, message: forbidden.to_string() });
        }
        self.settled(|robot| robot.set_parameters(changes, &self.caller))
    }

    /// Sets parameters from JSON, all at once, as [`Self::set_parameters`] does. A number is in SI; `1` is accepted for a float.
    ///
    /// # Errors
    /// As [`Self::set_parameters`], or the text is not a value of the parameter's type.
    pub fn set_parameters_json<'a>(
        &self,
        values: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<(), ParameterError> {
        let parse = |(path, json): (&'a str, &'a str)| {
            // Of one that does not exist, the path is refused, whatever the value.
            let read = match self.host.controls().parameter(path) {
                Some(like) => parameter_from_json(&like, json),
                None => Ok(ParameterValue::Text(String::new())),
            };
            match read {
                Ok(value) => Ok((path.to_owned(), value)),
                Err(error) => Err(ParameterError { path: path.to_owned(), message: error.to_string() }),
            }
        };
        self.set_all(values.into_iter().map(parse).collect::<Result<_, _>>()?)
    }

    /// Sends a command in JSON to the actuator at `path`, and returns the one that was carried out: with the limits of the joint applied.
    /// [`ComponentDescription::command`](super::ComponentDescription::command) is its shape.
    ///
    /// # Errors
    /// As [`ActuatorLink::apply`], or the text does not fit the shape, no actuator is there, or the caller may not send to actuators.
    pub fn send_json(&self, path: &str, command: &str) -> Result<String, Fault> {
        self.check(Right::Actuators)?;
        self.caller.check_valid()?;
        let actuator = self.host.json_actuator(path).ok_or_else(|| self.no_actuator(path))?;
        self.settled(|_| actuator.accept_json(command, &self.caller))
    }

    /// The report of the run so far, as [`Report::to_json`](crate::Report::to_json) writes it, with what is wrong first: what a caller that
    /// comes late has missed.
    ///
    /// # Errors
    /// The robot has not started or is gone, or the caller may not read.
    pub fn report_json(&self) -> Result<String, Fault> {
        self.check(Right::Read)?;
        self.host.report_json().ok_or_else(|| Fault::new("the robot has not started, or is gone"))
    }

    /// Returns the kind of the run: in real time, in a simulation or from a journal.
    pub fn run_kind(&self) -> RunKind {
        self.host.controls().kind_of_run()
    }

    /// The whole robot: links, joints, components, topics, parameters and commands, with their schemas. For a caller that may not
    /// read, without the parameters.
    pub fn description(&self) -> Description {
        let mut description = self.host.description();
        if self.check(Right::Read).is_err() {
            description.parameters.clear();
        }
        description
    }

    /// The robot as a picture, like [`Robot::graph`](crate::run::Robot::graph), with replaced components marked.
    pub fn graph(&self, format: GraphFormat) -> String {
        self.host.graph(format)
    }

    /// All commands, with the shapes of their arguments and results.
    pub fn commands(&self) -> Vec<CommandInfo> {
        self.host.controls().commands()
    }

    /// Starts the command at `path` with arguments from JSON; an empty string means the default arguments.
    ///
    /// # Errors
    /// There is no such command, the arguments do not fit its shape, it is refused, or the caller may not start commands.
    pub fn start_command(&self, path: &str, arguments: &str) -> Result<DynamicExecution, Fault> {
        self.check(Right::Commands)?;
        self.caller.check_valid()?;
        self.settled(|robot| robot.start_command(path, arguments, &self.caller))
    }

    /// The executions of commands that have not ended, whoever started them; none for a caller that may not read.
    pub fn executions(&self) -> Vec<ExecutionInfo> {
        if self.check(Right::Read).is_err() {
            return Vec::new();
        }
        self.host.controls().executions()
    }

    /// Cancels the execution of that number, whoever started it.
    ///
    /// # Errors
    /// No such execution runs, or the caller may not start commands.
    pub fn cancel(&self, execution: u64) -> Result<(), Fault> {
        self.check(Right::Commands)?;
        self.settled(|robot| robot.cancel(execution, &self.caller))
    }

    /// The operational state: `disarmed`, `idle`, `executing`, or a declared one.
    pub fn state(&self) -> &'static str {
        self.host.controls().state()
    }

    /// The safety state.
    pub fn safety(&self) -> Safety {
        self.host.controls().safety()
    }

    /// Arms the robot, as a command would. A robot that is armed already stays so.
    ///
    /// # Errors
    /// Why it is not armed: it is in `error`, is being disarmed or stops, or the code of cancelled commands has not returned
    /// within 5 s; or the caller may not arm it.
    pub fn arm(&self) -> Result<(), ArmError> {
        self.check(Right::Arm).map_err(ArmError::Forbidden)?;
        self.settled(|robot| robot.arm(&self.caller))
    }

    /// Disarms the robot: commands are cancelled, and the owners of hardware make it safe, within 5 s. Every caller may.
    ///
    /// # Errors
    /// What could not be made safe; the safety state is then `error`.
    pub fn disarm(&self) -> Result<(), DisarmError> {
        self.settled(|robot| robot.disarm(false, &self.caller))
    }

    /// Leaves the safety state `error`, even if something still cannot be made safe; the caller must have checked
    /// that.
    ///
    /// # Errors
    /// What could not be made safe again. The safety state is `disarmed` nevertheless. Or the caller may not arm the robot.
    pub fn force_disarm(&self) -> Result<(), DisarmError> {
        self.check(Right::Arm).map_err(DisarmError::Forbidden)?;
        self.settled(|robot| robot.disarm(true, &self.caller))
    }

    /// Disarms the robot, cancels its commands, and has its sensors and services stop as soon as it is safe. Does not wait.
    ///
    /// # Errors
    /// The caller may not arm the robot.
    pub fn request_stop(&self) -> Result<(), Fault> {
        self.check(Right::Arm)?;
        self.settled(|robot| robot.request_stop(&self.caller))
    }

    /// The states of the joints, and all frames at any time. Every caller may see where the robot is.
    pub fn joints(&self) -> Joints {
        self.host.joints()
    }

    /// The clock of the run.
    pub fn clock(&self) -> &Clock {
        self.host.controls().clock()
    }

    /// Acts on the robot; for a caller from outside, what follows is settled on virtual time.
    fn settled<T>(&self, act: impl FnOnce(&dyn Controls) -> T) -> T {
        let result = act(self.host.controls());
        if self.caller.is_outside() {
            self.host.settle();
        }
        result
    }

    /// Calls `call` with all topics that have a publisher.
    fn with_topics<T: Default>(&self, mut call: impl FnMut(&[&dyn AnyTopic]) -> T) -> T {
        let mut result = T::default();
        self.visit_topics(&mut |topics| result = call(topics));
        result
    }

    /// The body of [`Self::with_topics`], which is compiled once.
    fn visit_topics(&self, visit: &mut dyn FnMut(&[&dyn AnyTopic])) {
        let made = self.host.registry().published_topics();
        self.host.with_topics(&mut |topics| {
            let mut all = topics.to_vec();
            for topic in &made {
                all.push(&**topic);
            }
            visit(&all);
        });
    }
}

impl fmt::Debug for Bus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bus").finish_non_exhaustive()
    }
}
