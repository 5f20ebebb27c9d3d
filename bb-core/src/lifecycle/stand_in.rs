//! Replacements of declared components: simulated sensors and actuators.

use crate::component::replacement::Replacement;
use crate::component::{Actuator, ActuatorContext, Options, Reading, Sensor, SensorContext};
use crate::fault::Fault;
use crate::message::{Payload, Stamped};
use crate::time::MonotonicTime;

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

/// A sensor of type `S`, with options, to replace another one.
pub(crate) fn replacement_of_sensor<S: Sensor>(options: S::Options) -> Replacement
where
    S::Options: Sync,
{
    let make: MakeSensor<S::Output> = Box::new(move |context| {
        options.validate().map_err(Fault::permanent)?;
        Ok(Box::new(S::init(options.clone(), context)?))
    });
    Replacement::new(make, S::Output::NAME)
}

/// An actuator of type `A`, with options, to replace another one.
pub(crate) fn replacement_of_actuator<A: Actuator>(options: A::Options) -> Replacement
where
    A::Options: Sync,
{
    let make: MakeActuator<A::Command> = Box::new(move |context| {
        options.validate().map_err(Fault::permanent)?;
        Ok(Box::new(A::init(options.clone(), context)?))
    });
    Replacement::new(make, A::Command::NAME)
}

/// Creates the replacement of a sensor that publishes `T`.
pub(super) fn make_sensor<T: Payload>(
    replacement: &Replacement,
    context: &SensorContext,
) -> Result<Box<dyn AnySensor<T>>, Fault> {
    let make = replacement.make::<MakeSensor<T>>();
    make.ok_or_else(|| other(replacement, "publishes", T::NAME))?(context)
}

/// Creates the replacement of an actuator that takes `T`.
pub(super) fn make_actuator<T: Payload>(
    replacement: &Replacement,
    context: &ActuatorContext,
) -> Result<Box<dyn StandIn<T>>, Fault> {
    let make = replacement.make::<MakeActuator<T>>();
    make.ok_or_else(|| other(replacement, "takes", T::NAME))?(context)
}

fn other(replacement: &Replacement, does: &str, declared: &str) -> Fault {
    let payload = replacement.payload();
    Fault::permanent(format!("its replacement {does} `{payload}`, and what is declared {does} `{declared}`"))
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
