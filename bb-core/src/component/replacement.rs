//! Components that take the place of declared ones: simulated sensors and actuators.

use super::{Actuator, ActuatorContext, Fault, Options, Reading, Sensor, SensorContext};
use crate::message::{Payload, Stamped};
use crate::time::MonotonicTime;
use std::any::Any;
use std::sync::Arc;

/// Makes a component that takes the place of another one: a `MakeSensor<T>` or a `MakeActuator<T>`, by the kind of payload.
#[derive(Clone)]
pub(crate) struct Replacement {
    make: Arc<dyn Any + Send + Sync>,
    /// The name of its payload.
    payload: &'static str,
}

type Make<C, T> = Box<dyn Fn(&C) -> Result<T, Fault> + Send + Sync>;
type MakeSensor<T> = Make<SensorContext, Box<dyn AnySensor<T>>>;
type MakeActuator<T> = Make<ActuatorContext, Box<dyn StandIn<T>>>;

/// A sensor that publishes `T`.
pub(crate) trait AnySensor<T>: Send {
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<T>, Fault>;
    fn starts_at(&self) -> Option<MonotonicTime>;
    fn terminate(&mut self);
}

/// An actuator that takes commands of type `T`.
pub(crate) trait StandIn<T>: Send {
    fn handle_command(&mut self, command: &Stamped<T>) -> Result<(), Fault>;
    fn next_update(&self) -> Option<MonotonicTime>;
    fn update(&mut self, now: MonotonicTime) -> Result<(), Fault>;
    fn disarm(&mut self) -> Result<(), Fault>;
    fn terminate(&mut self);
}

impl Replacement {
    pub(crate) fn sensor<S: Sensor>(options: S::Options) -> Self
    where
        S::Options: Sync,
    {
        let make: MakeSensor<S::Output> = Box::new(move |context| {
            options.validate().map_err(Fault::permanent)?;
            Ok(Box::new(S::init(options.clone(), context)?))
        });
        Self { make: Arc::new(make), payload: S::Output::NAME }
    }

    pub(crate) fn actuator<A: Actuator>(options: A::Options) -> Self
    where
        A::Options: Sync,
    {
        let make: MakeActuator<A::Command> = Box::new(move |context| {
            options.validate().map_err(Fault::permanent)?;
            Ok(Box::new(A::init(options.clone(), context)?))
        });
        Self { make: Arc::new(make), payload: A::Command::NAME }
    }

    pub(crate) fn make_sensor<T: Payload>(&self, context: &SensorContext) -> Result<Box<dyn AnySensor<T>>, Fault> {
        let make = self.make.downcast_ref::<MakeSensor<T>>();
        make.ok_or_else(|| self.other("publishes", T::NAME))?(context)
    }

    pub(crate) fn make_actuator<T: Payload>(
        &self,
        context: &ActuatorContext,
    ) -> Result<Box<dyn StandIn<T>>, Fault> {
        let make = self.make.downcast_ref::<MakeActuator<T>>();
        make.ok_or_else(|| self.other("takes", T::NAME))?(context)
    }

    fn other(&self, does: &str, declared: &str) -> Fault {
        let payload = self.payload;
        Fault::permanent(format!("its replacement {does} `{payload}`, and what is declared {does} `{declared}`"))
    }
}

impl<S: Sensor> AnySensor<S::Output> for S {
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        Sensor::read(self, now)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        Sensor::starts_at(self)
    }

    fn terminate(&mut self) {
        Sensor::terminate(self);
    }
}

impl<A: Actuator> StandIn<A::Command> for A {
    fn handle_command(&mut self, command: &Stamped<A::Command>) -> Result<(), Fault> {
        Actuator::handle_command(self, command)
    }

    fn next_update(&self) -> Option<MonotonicTime> {
        Actuator::next_update(self)
    }

    fn update(&mut self, now: MonotonicTime) -> Result<(), Fault> {
        Actuator::update(self, now)
    }

    fn disarm(&mut self) -> Result<(), Fault> {
        Actuator::disarm(self)
    }

    fn terminate(&mut self) {
        Actuator::terminate(self);
    }
}
