//! A robot before it starts, as its users see it.

use super::draft::Draft;
use super::handle::{Configurable, ParameterHandle, Publisher};
use super::source::OpenSources;
use super::wired::{Parts, declaration};
use super::{Live, Replay, Robot, Running, Simulation, StartError, Supervision};
use crate::declaration::{ParameterError, ParameterType};
use crate::joints::JointSettings;
use crate::journal::Entry;
use crate::node::Mode;
use crate::pubsub::{Delivery, DynamicSubscription, Overflow, Payloads, Select, Subscription};
use crate::telemetry::TelemetryEvent;
use crate::time::{Clock, MonotonicTime};
use std::fmt;
use std::sync::Arc;

/// A robot that is assembled but not yet started. Options may still be changed, and a subscription made here misses
/// nothing.
pub struct Builder<R: Robot> {
    pub(super) draft: Draft,
    topics: R::Topics,
}

impl<R: Robot> Builder<R> {
    pub(super) fn new() -> Self {
        let parts = Parts::<R>::new(R::topics());
        let draft = Draft::new(declaration::<R>(), R::options, &parts);
        Self { draft, topics: parts.into_topics() }
    }

    /// The options of a component, initially as declared. They are validated at the start. An option bound to a
    /// parameter takes that parameter's value, whatever is set here.
    pub fn options<C: Configurable<R>>(&mut self, component: C) -> &mut C::Options {
        component.options(&mut self.draft.options)
    }

    /// Sets a parameter before the start.
    ///
    /// # Errors
    /// What was expected.
    pub fn set_parameter<T: ParameterType>(
        &mut self,
        parameter: ParameterHandle<R, T>,
        value: T,
    ) -> Result<(), ParameterError> {
        self.draft.set_parameter(parameter.number, value.into_value())
    }

    /// Returns the settings of the restarts of components that fail, to be changed.
    pub fn supervision(&mut self) -> &mut Supervision {
        &mut self.draft.supervision
    }

    /// Returns the settings of the history of joint states, to be changed: its length, and the time for which a state is valid.
    pub fn joints(&mut self) -> &mut JointSettings {
        &mut self.draft.joints
    }

    /// Names the machine or process that runs the robot: the `node` of its messages' origin. `local` unless it is set.
    pub fn node(&mut self, name: &'static str) -> &mut Self {
        self.draft.node = name;
        self
    }

    /// Hands every processed entry to `sink`, enough to run the robot again: see [`journal`](crate::journal). The
    /// sink is called on its own thread, on virtual time on the caller's. A slow sink makes sensors and other outside
    /// producers wait. A sink that hangs for 2 s ends the journal, which is reported.
    pub fn journal(&mut self, sink: impl Fn(Entry) + Send + Sync + 'static) {
        self.draft.journal = Some(Arc::new(sink));
    }

    /// Publishes the journal at `journal`, for a recorder. Give its subscription room: a journal that lost lines
    /// cannot be replayed beyond the gap.
    pub fn publish_journal(&mut self) {
        self.draft.publish_journal();
    }

    /// Attaches a telemetry handler, which gets the robot's name with every event. Inputs, outputs, latencies and
    /// drops are reported on the thread that runs the estimator, so the handler must be quick; transitions and faults
    /// on a separate thread. With a handler, every callback is measured, which costs two reads of the processor's counter.
    pub fn telemetry(&mut self, handler: impl Fn(&'static str, &TelemetryEvent) + Send + Sync + 'static) {
        self.draft.telemetry.push(Arc::new(handler));
    }

    /// Subscribes, with room for 1024 messages.
    pub fn subscribe<P: Publisher<R>>(&self, publisher: P) -> Subscription<P::Payload> {
        self.subscribe_with(publisher, Overflow::default())
    }

    /// Subscribes with an [`Overflow`], for a subscriber that is slow, or with a highest rate,
    /// [`Overflow::at_most_every`].
    pub fn subscribe_with<P: Publisher<R>>(
        &self,
        publisher: P,
        delivery: impl Into<Delivery>,
    ) -> Subscription<P::Payload> {
        let system = &self.draft.system;
        publisher.topic(&self.topics, system).subscribe_on(delivery.into(), system.registry.timer())
    }

    /// Subscribes to messages of any payload, by path; with names of payload types, only to those. It gets what the same
    /// subscription made on the running robot gets, from the first message on.
    pub fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        delivery: impl Into<Delivery>,
    ) -> DynamicSubscription {
        let topics = (0..).map_while(|publisher| R::topic(&self.topics, publisher)).collect();
        self.draft.subscribe_any(topics, select, &payloads.into(), delivery.into())
    }

    /// Starts the robot in real time, with one thread per sensor.
    ///
    /// # Errors
    /// Names the component that cannot start. Components that had started are stopped in order.
    pub fn start(self) -> Result<Running<R>, StartError> {
        let (live, sources) = self.assemble(Clock::real(), Mode::Real)?;
        Running::start(live, sources)
    }

    /// Starts the robot on virtual time, from zero or from the first stamp of a recording: nothing moves until the caller
    /// runs it.
    ///
    /// # Errors
    /// Names the component that cannot start. Components that had started are stopped in order.
    pub fn simulate(self) -> Result<Simulation<R>, StartError> {
        let (live, sources) = self.assemble(Clock::virtual_at(MonotonicTime::ZERO), Mode::Virtual)?;
        Ok(Simulation::new(live, sources))
    }

    /// Prepares to replay a robot from a journal: on virtual time, without sensors, services, actuators or the code
    /// of commands. Options of estimators must be the same as in the recorded run.
    ///
    /// # Errors
    /// Names the component that cannot start.
    pub fn replay(self) -> Result<Replay<R>, StartError> {
        let (live, _) = self.assemble(Clock::virtual_at(MonotonicTime::from_nanos(i64::MIN)), Mode::Replay)?;
        Ok(Replay::new(live))
    }

    fn assemble(self, clock: Clock, mode: Mode) -> Result<(Live<R>, OpenSources), StartError> {
        let mut parts = Parts::<R>::new(self.topics);
        let (machine, sources) = self.draft.assemble(&mut parts, clock, mode)?;
        Ok((Live { machine, wiring: parts.into_wiring()? }, sources))
    }
}

impl<R: Robot> fmt::Debug for Builder<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Builder").field(&R::NAME).finish()
    }
}

/// No robot implements it.
#[doc(hidden)]
#[diagnostic::on_unimplemented(
    message = "a robot is assembled with `{Self}::builder()`, and there is no `new`",
    label = "call `builder` instead"
)]
pub trait MadeByNew {}
