//! Replacements of declared components: simulated sensors and actuators, other estimators, controllers and bridges.

use crate::component::replacement::Replacement;
use crate::component::{
    Actuator, ActuatorContext, Context, Estimator, Info, InputTransforms, Inputs, Options, Outputs, Reading, Reply,
    Sensor, SensorContext,
};
use crate::fault::{Fault, Termination};
use crate::message::{Payload, Stamped};
use crate::time::MonotonicTime;
use std::any::type_name;
use std::sync::Arc;

type Make<C, T> = Box<dyn Fn(&C) -> Result<T, Fault> + Send + Sync>;

/// An estimator that takes `I` and emits `O`.
pub(crate) trait AnyEstimator<I: Inputs, O>: Send {
    fn handle_input(&mut self, input: I::View<'_>) -> Result<Reply<O>, Fault>;
    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault>;
    fn handle_info(&mut self, info: Info) -> Result<Reply<O>, Fault>;
    fn handle_continue(&mut self, step: u32) -> Result<Reply<O>, Fault>;
    fn handle_end(&mut self) -> Option<O>;
    fn terminate(&mut self, reason: Termination<'_>);
}

/// A sensor or a service that publishes `T`.
pub(crate) trait AnySensor<T>: Send {
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<T>, Fault>;
    fn starts_at(&self) -> Option<MonotonicTime>;
    fn terminate(&mut self, reason: Termination<'_>);
}

/// An actuator that takes commands of type `T`.
pub(crate) trait StandIn<T>: Send {
    fn handle_command(&mut self, command: &Stamped<T>) -> Result<(), Fault>;
    fn next_update(&self) -> Option<MonotonicTime>;
    fn update(&mut self, now: MonotonicTime) -> Result<(), Fault>;
    fn disarm(&mut self) -> Result<(), Fault>;
    fn terminate(&mut self, reason: Termination<'_>);
}

/// An estimator of type `E`, with options, to replace another one.
pub(crate) fn replacement_of_estimator<E: Estimator>(options: E::Options) -> Replacement
where
    E::Options: Sync,
{
    let options = Arc::new(options);
    let shown = Arc::clone(&options);
    let make: Make<Context, Box<dyn AnyEstimator<E::Input, E::Output>>> = Box::new(move |context| {
        options.validate().map_err(Fault::permanent)?;
        Ok(Box::new(E::init(E::Options::clone(&options), context)?))
    });
    let shown = move || format!("{} {shown:?}", type_name::<E>());
    Replacement::new(make, takes_and_emits::<E::Input, E::Output>()).of_estimator(E::HANDLES_MOVING_JOINTS, shown)
}

/// A sensor of type `S`, with options, to replace another one.
pub(crate) fn replacement_of_sensor<S: Sensor>(options: S::Options) -> Replacement
where
    S::Options: Sync,
{
    let make: Make<SensorContext, Box<dyn AnySensor<S::Output>>> = Box::new(move |context| {
        options.validate().map_err(Fault::permanent)?;
        Ok(Box::new(S::init(options.clone(), context)?))
    });
    Replacement::new(make, publishes::<S::Output>())
}

/// An actuator of type `A`, with options, to replace another one.
pub(crate) fn replacement_of_actuator<A: Actuator>(options: A::Options) -> Replacement
where
    A::Options: Sync,
{
    let make: Make<ActuatorContext, Box<dyn StandIn<A::Command>>> = Box::new(move |context| {
        options.validate().map_err(Fault::permanent)?;
        Ok(Box::new(A::init(options.clone(), context)?))
    });
    Replacement::new(make, takes::<A::Command>()).of_actuator(A::SIDE)
}

/// Creates the replacement of an estimator that takes `I` and emits `O`.
pub(super) fn make_estimator<I: Inputs, O: Outputs>(
    replacement: &Replacement,
    context: &Context,
) -> Result<Box<dyn AnyEstimator<I, O>>, Fault> {
    made(replacement, context, takes_and_emits::<I, O>)
}

/// Creates the replacement of a sensor or, with its context, of a service, which publishes `T`.
pub(super) fn make_sensor<C: 'static, T: Payload>(
    replacement: &Replacement,
    context: &C,
) -> Result<Box<dyn AnySensor<T>>, Fault> {
    made(replacement, context, publishes::<T>)
}

/// Creates the replacement of an actuator that takes `T`.
pub(super) fn make_actuator<T: Payload>(
    replacement: &Replacement,
    context: &ActuatorContext,
) -> Result<Box<dyn StandIn<T>>, Fault> {
    made(replacement, context, takes::<T>)
}

/// Creates a replacement, unless it is of another type than what is declared, which does what `declared` says.
fn made<C: 'static, T: 'static>(
    replacement: &Replacement,
    context: &C,
    declared: fn() -> String,
) -> Result<T, Fault> {
    let make = replacement.make::<Make<C, T>>().ok_or_else(|| {
        let (does, declared) = (replacement.does(), declared());
        Fault::permanent(format!("its replacement {does}, and what is declared {declared}"))
    })?;
    make(context)
}

fn publishes<T: Payload>() -> String {
    format!("publishes `{}`", T::NAME)
}

fn takes<T: Payload>() -> String {
    format!("takes `{}`", T::NAME)
}

/// A struct of inputs or outputs has no name but that of its type.
fn takes_and_emits<I, O>() -> String {
    format!("takes `{}` and emits `{}`", type_name::<I>(), type_name::<O>())
}

impl<E: Estimator> AnyEstimator<E::Input, E::Output> for E {
    fn handle_input(&mut self, input: <E::Input as Inputs>::View<'_>) -> Result<Reply<E::Output>, Fault> {
        Estimator::handle_input(self, input)
    }

    fn handle_transforms(&mut self, transforms: &InputTransforms<'_>) -> Result<(), Fault> {
        Estimator::handle_transforms(self, transforms)
    }

    fn handle_info(&mut self, info: Info) -> Result<Reply<E::Output>, Fault> {
        Estimator::handle_info(self, info)
    }

    fn handle_continue(&mut self, step: u32) -> Result<Reply<E::Output>, Fault> {
        Estimator::handle_continue(self, step)
    }

    fn handle_end(&mut self) -> Option<E::Output> {
        Estimator::handle_end(self)
    }

    fn terminate(&mut self, reason: Termination<'_>) {
        Estimator::terminate(self, reason);
    }
}

impl<S: Sensor> AnySensor<S::Output> for S {
    fn read(&mut self, now: MonotonicTime) -> Result<Reading<S::Output>, Fault> {
        Sensor::read(self, now)
    }

    fn starts_at(&self) -> Option<MonotonicTime> {
        Sensor::starts_at(self)
    }

    fn terminate(&mut self, reason: Termination<'_>) {
        Sensor::terminate(self, reason);
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

    fn terminate(&mut self, reason: Termination<'_>) {
        Actuator::terminate(self, reason);
    }
}
