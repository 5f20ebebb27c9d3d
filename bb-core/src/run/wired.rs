//! A robot without its type: what all of `run` works with.
//!
//! `robot!` implements [`Robot`] for its type. The few functions here that are generic over it are compiled for each robot;
//! everything else in this folder is compiled once. [`Unwired`] is a robot before its start, whose topics exist;
//! [`Wired`] is one whose components have been made.

use super::actuator::AnyActuator;
use super::source::{Assembly, ExternalSensors, Sources};
use super::{Robot, StartError};
use crate::component::{ExternalSensor, Fault, OptionsList};
use crate::control::Prepared;
use crate::declaration::RobotDeclaration;
use crate::node::AnyIsland;
use crate::pubsub::{AnyTopic, DynamicMessage};
use crate::time::MonotonicTime;
use std::any::Any;
use std::sync::{Arc, OnceLock, Weak};

/// The declaration of `R` as data.
pub(super) fn declaration<R: Robot>() -> &'static RobotDeclaration {
    const {
        &RobotDeclaration {
            name: R::NAME,
            topology: R::TOPOLOGY,
            sensors: R::SENSORS,
            estimators: R::ESTIMATORS,
            actuators: R::ACTUATORS,
            services: R::SERVICES,
            states: R::STATES,
            categories: R::CATEGORIES,
            commands: R::COMMANDS,
            parameters: R::PARAMETERS,
            bound_options: R::BOUND_OPTIONS,
        }
    }
}

/// A robot before its start.
pub(super) trait Unwired {
    /// The topics of its publishers.
    fn topics(&self) -> Vec<&dyn AnyTopic>;
    /// The commands with their options.
    fn commands(&self, options: &OptionsList) -> Vec<Prepared>;
    /// Makes its estimators and actuators; errors are stored in `assembly`. Called once.
    fn wire(&mut self, options: &OptionsList, assembly: &Assembly) -> Wired;
    /// Takes its hold on the wiring, which is dropped elsewhere if the robot does not start.
    fn take_wiring(&mut self) -> Option<Arc<dyn Any + Send + Sync>>;
}

/// The topics of `R`, and its wiring once it is wired.
pub(super) struct Parts<R: Robot> {
    topics: R::Topics,
    wiring: Option<Arc<R::Wiring>>,
}

impl<R: Robot> Parts<R> {
    pub(super) fn new(topics: R::Topics) -> Self {
        Self { topics, wiring: None }
    }

    pub(super) fn into_topics(self) -> R::Topics {
        self.topics
    }

    /// The wiring of a robot that has been assembled.
    pub(super) fn into_wiring(self) -> Result<Arc<R::Wiring>, StartError> {
        self.wiring.ok_or_else(|| StartError::component(R::NAME, Fault::new("it has not been wired")))
    }
}

impl<R: Robot> Unwired for Parts<R> {
    fn topics(&self) -> Vec<&dyn AnyTopic> {
        (0..).map_while(|publisher| R::topic(&self.topics, publisher)).collect()
    }

    fn commands(&self, options: &OptionsList) -> Vec<Prepared> {
        R::commands(options)
    }

    fn wire(&mut self, options: &OptionsList, assembly: &Assembly) -> Wired {
        let topics = std::mem::replace(&mut self.topics, R::topics());
        let wiring = Arc::new(R::wire(topics, options, assembly));
        self.wiring = Some(Arc::clone(&wiring));
        let islands = R::ISLANDS.iter().map(|island| island(&wiring)).collect();
        Wired { islands, parts: Box::new(WiringOf::<R>(wiring)), external: OnceLock::new() }
    }

    fn take_wiring(&mut self) -> Option<Arc<dyn Any + Send + Sync>> {
        self.wiring.take().map(|wiring| wiring as _)
    }
}

/// A reference to the wired robot, once there is one. Weak, since components with a bus are part of it.
pub(super) type Place = Arc<OnceLock<Weak<Wired>>>;

/// A robot whose components have been made.
pub(super) struct Wired {
    parts: Box<dyn Wiring>,
    /// The islands, in the order of their numbers.
    pub(super) islands: Box<[Box<dyn AnyIsland>]>,
    /// The sensors whose messages other code publishes, once it does.
    external: OnceLock<ExternalSensors>,
}

impl Wired {
    /// The topics of its publishers, in the order of their numbers.
    pub(super) fn topics(&self) -> Vec<&dyn AnyTopic> {
        (0..).map_while(|publisher| self.parts.topic(publisher)).collect()
    }

    /// The actuator with that number.
    pub(super) fn actuator(&self, number: usize) -> Option<&dyn AnyActuator> {
        self.parts.actuator(number)
    }

    /// The actuators, in the order of their numbers.
    pub(super) fn actuators(&self) -> Vec<&dyn AnyActuator> {
        (0..).map_while(|number| self.actuator(number)).collect()
    }

    /// The island with that number.
    pub(super) fn island(&self, number: usize) -> Option<&dyn AnyIsland> {
        self.islands.get(number).map(|island| &**island)
    }

    /// The sensor at `path`, if other code publishes its messages.
    pub(super) fn external(&self, path: &str) -> Option<ExternalSensor> {
        self.external_sensors().at(path)
    }

    /// The paths of those sensors.
    pub(super) fn externals(&self) -> Vec<&'static str> {
        self.external_sensors().paths()
    }

    /// Publishes a message at the path of such a sensor, if it has its payload.
    pub(super) fn enter(&self, message: &DynamicMessage, now: MonotonicTime) {
        self.external_sensors().enter(message, now);
    }

    fn external_sensors(&self) -> &ExternalSensors {
        self.external.get_or_init(|| self.sources().external())
    }

    /// The sensors and services, not made yet.
    pub(super) fn sources(&self) -> Sources {
        self.parts.sources()
    }
}

/// The parts of a wiring.
trait Wiring: Send + Sync {
    fn topic(&self, publisher: usize) -> Option<&dyn AnyTopic>;
    fn actuator(&self, number: usize) -> Option<&dyn AnyActuator>;
    fn sources(&self) -> Sources;
}

struct WiringOf<R: Robot>(Arc<R::Wiring>);

impl<R: Robot> Wiring for WiringOf<R> {
    fn topic(&self, publisher: usize) -> Option<&dyn AnyTopic> {
        R::topic(R::wired_topics(&self.0), publisher)
    }

    fn actuator(&self, number: usize) -> Option<&dyn AnyActuator> {
        R::actuator(&self.0, number)
    }

    fn sources(&self) -> Sources {
        R::sources(&self.0)
    }
}
