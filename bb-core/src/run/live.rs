//! What can be asked and told of a robot that runs, whoever drives it.

use super::handle::{ActuatorHandle, CommandHandle, ParameterHandle, Publisher, Visitable};
use super::machine::Machine;
use super::{ActuatorError, Bus, Report, Robot, SensorHandle};
use crate::component::{Actuator, Fault, HandleCall, HandleCast, Sensor};
use crate::control::{Command, Execution, ParameterError, ParameterType, Refusal, Safety};
use crate::pubsub::{DynamicSubscription, Overflow, Payloads, Select, Subscription};
use crate::time::{Clock, MonotonicTime};
use std::fmt;
use std::sync::Arc;

/// A robot that runs. [`Running`](super::Running) and [`Simulation`](super::Simulation) dereference to it; a clone may go
/// to another thread, into a driver's callback say, and lives on when the robot has stopped.
pub struct Live<R: Robot>(pub(super) Arc<Machine<R>>);

impl<R: Robot> Clone for Live<R> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<R: Robot> Live<R> {
    /// Its clock.
    pub fn clock(&self) -> &Clock {
        &self.0.startup.clock
    }

    /// Subscribes from now on, with room for 1024 messages.
    pub fn subscribe<P: Publisher<R>>(&self, publisher: P) -> Subscription<P::Payload> {
        self.subscribe_with(publisher, Overflow::default())
    }

    /// Subscribes from now on, and says what happens when the subscriber is slow.
    pub fn subscribe_with<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        self.0.subscribe(publisher, overflow)
    }

    /// Subscribes from now on to messages of any payload, by path; with names of payload types, to those only.
    pub fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        overflow: Overflow,
    ) -> DynamicSubscription {
        self.0.subscribe_any(select, payloads, overflow)
    }

    /// Topics, actuators, parameters and states, by path: for code that does not know this robot's type.
    pub fn bus(&self) -> Bus {
        self.0.startup.bus()
    }

    /// Asks an estimator, and waits for its answer. What it emits beside is published as always.
    ///
    /// # Errors
    /// The estimator does not run, or fails at this request; or an estimator's message has woken the caller on this very
    /// thread, so that he would wait for himself.
    pub fn call<V: Visitable<R>, Q>(
        &self,
        estimator: V,
        request: Q,
    ) -> Result<<V::Estimator as HandleCall<Q>>::Response, Fault>
    where
        V::Estimator: HandleCall<Q>,
    {
        self.0.call(estimator, request)
    }

    /// Tells an estimator something. It takes it when it is free; nobody waits.
    ///
    /// # Errors
    /// More than a thousand requests wait for it, or the robot has stopped.
    pub fn cast<V: Visitable<R>, Q: Send + 'static>(&self, estimator: V, request: Q) -> Result<(), Fault>
    where
        V::Estimator: HandleCast<Q>,
    {
        self.0.cast(estimator, request)
    }

    /// Starts a command.
    ///
    /// # Errors
    /// Why it is refused; that is counted and published as well.
    pub fn command<C: Command>(
        &self,
        command: CommandHandle<R, C>,
        arguments: C::Arguments,
    ) -> Result<Execution<C::Output>, Refusal> {
        self.0.command(command, arguments)
    }

    /// Sends a command to an actuator; it has been carried out when this returns.
    ///
    /// # Errors
    /// The robot is not armed, the command holds a NaN, or the actuator has failed.
    pub fn actuate<A: Actuator>(
        &self,
        actuator: ActuatorHandle<R, A>,
        command: A::Command,
    ) -> Result<(), ActuatorError> {
        self.0.actuate(actuator, command)
    }

    /// The value of a parameter.
    pub fn parameter<T: ParameterType>(&self, parameter: ParameterHandle<R, T>) -> T {
        self.0.parameter(parameter)
    }

    /// Sets a parameter: it is published, and reaches the options that are bound to it.
    ///
    /// # Errors
    /// What was expected, or which component would refuse it.
    pub fn set_parameter<T: ParameterType>(
        &self,
        parameter: ParameterHandle<R, T>,
        value: T,
    ) -> Result<(), ParameterError> {
        self.0.set_parameter(parameter, value)
    }

    /// The operational state: `disarmed`, `idle`, `executing`, or a declared one.
    pub fn state(&self) -> &'static str {
        self.0.startup.control.state()
    }

    /// The safety state.
    pub fn safety(&self) -> Safety {
        self.0.startup.control.safety()
    }

    /// Arms the robot, as a command would; true if it is armed now. In `error` it stays disarmed.
    pub fn arm(&self) -> bool {
        self.0.startup.control.arm(self.clock().now())
    }

    /// Disarms the robot: commands are cancelled, and whoever owns hardware makes it safe, within 5 s. True if all could;
    /// else the safety state is `error`.
    pub fn disarm(&self) -> bool {
        self.0.startup.control.disarm(false, self.clock().now())
    }

    /// Leads out of the safety state `error`, even if something still cannot be made safe: whoever calls it has seen to
    /// that.
    pub fn force_disarm(&self) -> bool {
        self.0.startup.control.disarm(true, self.clock().now())
    }

    /// What it has done so far.
    pub fn report(&self) -> Report {
        self.0.report()
    }

    /// Publishes as if `sensor` had measured `payload` at `time`; all estimators downstream run before this returns, but
    /// those that are busy on another thread or have one of their own.
    pub fn publish<S: Sensor>(&self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
        self.0.publish(sensor, time, payload);
    }

    /// A handle of its own, for another thread.
    pub fn live(&self) -> Self {
        self.clone()
    }

    /// Tells sensors, services and commands to stop, as `stop` of [`Running`](super::Running) does; nobody waits for them.
    pub fn request_stop(&self) {
        self.0.startup.stop.set();
        self.0.startup.agenda().interrupt();
        self.0.startup.control.ring();
    }
}

impl<R: Robot> fmt::Debug for Live<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Live").field(&R::NAME).finish()
    }
}
