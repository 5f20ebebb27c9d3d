//! The interface of a running robot: the same in real time, in a simulation and in a replay.

use super::handle::{ActuatorHandle, CommandHandle, ParameterHandle, Publisher};
use super::machine::Machine;
use super::visit::Visitable;
use super::{ActuatorError, Bus, Report, Robot, SensorHandle};
use crate::component::{Actuator, Caller, Command, Fault, HandleCall, HandleCast, RequestCodec, Sensor};
use crate::control::Execution;
use crate::declaration::{ParameterError, ParameterType};
use crate::event::Refusal;
use crate::journal::{Event, ParameterEntry, RequestKind};
use crate::node::{Node, NodeEntry, Turn, know_calls, know_casts};
use crate::pubsub::{Delivery, Overflow, Subscription};
use crate::time::MonotonicTime;
use std::any::Any;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

/// A running robot, by handle. [`Running`](super::Running) and [`Simulation`](super::Simulation) dereference to it, and it dereferences to
/// its [`Bus`], which has what needs no handle: states, arming, parameters by path. A clone may move to another thread, such as a driver's
/// callback, and outlives the run.
pub struct Live<R: Robot> {
    pub(super) machine: Arc<Machine>,
    pub(super) wiring: Arc<R::Wiring>,
}

impl<R: Robot> Clone for Live<R> {
    fn clone(&self) -> Self {
        Self { machine: Arc::clone(&self.machine), wiring: Arc::clone(&self.wiring) }
    }
}

impl<R: Robot> Live<R> {
    /// A value shared by the components of this run, created by `make` if there is none yet; see
    /// [`ComponentContext::shared`](crate::component::ComponentContext::shared). For a simulated robot, it gives
    /// access to its world.
    pub fn shared<T: Send + Sync + 'static>(&self, make: impl FnOnce() -> T) -> Arc<T> {
        self.machine.host.shared().get(make)
    }

    /// Subscribes from now on, with room for 1024 messages.
    pub fn subscribe<P: Publisher<R>>(&self, publisher: P) -> Subscription<P::Payload> {
        self.subscribe_with(publisher, Overflow::default())
    }

    /// Subscribes from now on, with an [`Overflow`], for a subscriber that is slow, or with a highest rate,
    /// [`Overflow::at_most_every`].
    pub fn subscribe_with<P: Publisher<R>>(
        &self,
        publisher: P,
        delivery: impl Into<Delivery>,
    ) -> Subscription<P::Payload> {
        let system = self.machine.control.topics();
        publisher
            .topic(R::wired_topics(&self.wiring), system)
            .subscribe_on(delivery.into(), system.registry.timer())
    }

    /// Topics, actuators, parameters, commands and states, by path: what this dereferences to, for code that does not know this robot's
    /// type.
    pub fn bus(&self) -> Bus {
        self.machine.bus.clone()
    }

    /// Sends a request to an estimator and waits for its answer. Outputs that it emits are published as usual.
    ///
    /// # Errors
    /// The estimator does not run, or fails at this request; or the call comes from a waker that the estimator's own
    /// message has woken on this thread, and would wait for itself.
    pub fn call<V: Visitable<R>, Q>(
        &self,
        estimator: V,
        request: Q,
    ) -> Result<<V::Estimator as HandleCall<Q>>::Response, Fault>
    where
        V::Estimator: HandleCall<Q>,
    {
        self.settled(|machine| {
            let number = estimator.number();
            machine.check_requests(number)?;
            know_calls::<V::Estimator, Q>();
            let codec = <V::Estimator as HandleCall<Q>>::RECORD;
            let recorded = RequestCodec::record(RequestKind::Call, codec, &request);
            let is_unrecorded = recorded.bytes.is_none();
            let mut request = Some(request);
            let path = machine.environment.node(number).declaration().path;
            let mut response = None;
            let mut call = |node: &mut dyn Any, turn: &Turn<'_>, emitted: &mut dyn Any| {
                let node = node.downcast_mut::<Node<V::Estimator>>()?;
                let emitted = emitted.downcast_mut()?;
                node.call(request.take()?, is_unrecorded, turn, emitted, &mut response)
            };
            let line = Event::Request { estimator: number, request: recorded };
            machine.visit(number, line, &mut call)?;
            response.unwrap_or_else(|| {
                let stopped = machine.environment.node(number).stopped();
                let reason = stopped.map_or_else(String::new, |stopped| stopped.reason);
                Err(Fault::new(format!("{path} failed at this call: {reason}")))
            })
        })
    }

    /// Sends a one-way request to an estimator, which handles it when it is free. Does not wait.
    ///
    /// # Errors
    /// More than a thousand requests wait for it, or the robot has stopped.
    pub fn cast<V: Visitable<R>, Q: Send + 'static>(&self, estimator: V, request: Q) -> Result<(), Fault>
    where
        V::Estimator: HandleCast<Q>,
    {
        self.settled(|machine| {
            let number = estimator.number();
            machine.check_requests(number)?;
            know_casts::<V::Estimator, Q>();
            let (request, handle) = Node::<V::Estimator>::cast(request);
            machine.cast(number, NodeEntry::Cast { request, handle: Some(handle) })?;
            // On virtual time, nothing else would process it before the simulation continues.
            machine.environment.drain_posted();
            Ok(())
        })
    }

    /// Starts a command.
    ///
    /// # Errors
    /// The command is refused; the refusal is counted and published as well.
    pub fn command<C: Command>(
        &self,
        command: CommandHandle<R, C>,
        arguments: C::Arguments,
    ) -> Result<Execution<C::Output>, Refusal> {
        self.settled(|machine| machine.control.execute(command.number, Box::new(arguments)))
    }

    /// Sends a command to an actuator, and returns once it has been carried out.
    ///
    /// # Errors
    /// The robot is not armed, the command holds a NaN, or the actuator has failed.
    pub fn actuate<A: Actuator>(
        &self,
        actuator: ActuatorHandle<R, A>,
        command: A::Command,
    ) -> Result<(), ActuatorError> {
        self.settled(|_| (actuator.node)(&self.wiring).send(command))
    }

    /// The value of a parameter.
    pub fn parameter<T: ParameterType>(&self, parameter: ParameterHandle<R, T>) -> T {
        self.machine.control.parameters().get(parameter.number)
    }

    /// Sets a parameter. The change is published and reaches the options bound to it.
    ///
    /// # Errors
    /// The value is not accepted: it is out of the parameter's range, or the named component refuses it.
    pub fn set_parameter<T: ParameterType>(
        &self,
        parameter: ParameterHandle<R, T>,
        value: T,
    ) -> Result<(), ParameterError> {
        let entry = ParameterEntry { parameter: parameter.number, value: value.into_value() };
        self.settled(|machine| machine.control.set_entries(vec![entry], &Caller::PROGRAM))
    }

    /// A report of the run so far.
    pub fn report(&self) -> Report {
        self.machine.report()
    }

    /// Publishes as if `sensor` had measured `payload` at `time`. All estimators downstream run before this returns,
    /// except those that are busy on another thread or have their own.
    pub fn publish<S: Sensor>(&self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
        self.settled(|machine| {
            let environment = &machine.environment;
            let Some(_inside) = environment.door().enter() else { return };
            let stamp = environment.stamp(time, sensor.frame);
            (sensor.publish)(&self.wiring, &stamp.message(payload), environment.clock().now());
        });
    }

    /// A separate handle, for another thread.
    pub fn live(&self) -> Self {
        self.clone()
    }

    /// Disarms the robot, cancels its commands, and tells sensors and services to stop as soon as it is safe. Does not wait.
    pub fn request_stop(&self) {
        self.settled(|machine| machine.control.begin_stop(&Caller::PROGRAM));
    }

    /// Makes Ctrl-C, and on Unix the signals `SIGTERM` and `SIGHUP`, call [`Self::request_stop`]. The robot is
    /// disarmed before anything else, even if other code hangs, and [`Running::wait`](super::Running::wait) returns
    /// within 6 s.
    ///
    /// Another signal, half a second later or more, ends the process: as soon as the disarm callbacks have returned or their
    /// 5 s have passed. On Unix the process dies of that signal, which a shell shows as 130 for Ctrl-C and 143 for
    /// `SIGTERM`; elsewhere it exits with 130. What [`Running::stop`](super::Running::stop) would still have done is
    /// lost: `terminate`, the report, the last lines of the journal, the end of a recording (it is readable up to there).
    ///
    /// # Errors
    /// The system refuses a handler or the thread that waits for signals. A process has one, which stops all its robots: another
    /// signal ends it when all of them are safe.
    #[cfg(feature = "signals")]
    pub fn stop_on_signals(&self) -> std::io::Result<()> {
        let (live, control, machine) = (self.clone(), self.machine.control.clone(), Arc::clone(&self.machine));
        let stop = move || {
            // On virtual time the caller runs the disarm callbacks, which may hang: the thread that waits for signals must not.
            let stopped = live.clone();
            let is_left = live.clock().is_virtual()
                && std::thread::Builder::new()
                    .name("stop".to_owned())
                    .spawn(move || stopped.request_stop())
                    .is_ok();
            if !is_left {
                live.request_stop();
            }
        };
        super::signals::stop_on_signals(stop, move || control.wait_until_disarmed(), move || machine.has_ended())
    }

    /// Performs an outside action; on virtual time, then passes the journal's lines to its sink.
    fn settled<T>(&self, call: impl FnOnce(&Machine) -> T) -> T {
        let result = call(&self.machine);
        self.machine.settle();
        result
    }
}

impl<R: Robot> Deref for Live<R> {
    type Target = Bus;
    fn deref(&self) -> &Bus {
        &self.machine.bus
    }
}

impl<R: Robot> fmt::Debug for Live<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Live").field(&R::NAME).finish()
    }
}
