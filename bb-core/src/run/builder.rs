//! A robot before it starts.

use super::bus::Wired;
use super::handle::{Configurable, ParameterHandle, Publisher};
use super::machine::Machine;
use super::{Replay, Robot, Running, Simulation, Source, StartError, Startup, Supervision};
use crate::component::Fault;
use crate::control::{
    Control, Declared, ParameterError, ParameterType, ParameterValue, ParameterValues, SystemTopics,
};
use crate::journal::{Entry, Journal, JournalLine};
use crate::message::{Origin, Stamp};
use crate::pubsub::{AnyTopic, DynamicSubscription, Overflow, Payloads, Registry, Select, Subscription};
use crate::time::{Clock, MonotonicTime};
use std::fmt;
use std::sync::Arc;

/// The wiring with its estimators, and the sensors that feed it.
type Assembled<R> = (Machine<R>, Vec<Box<dyn Source>>);

/// A robot that is assembled and not yet started: options may still be changed, and a subscription made here misses
/// nothing.
pub struct Builder<R: Robot> {
    options: R::Options,
    topics: R::Topics,
    system: Arc<SystemTopics>,
    parameters: Vec<ParameterValue>,
    supervision: Supervision,
    journal: Option<Journal>,
}

impl<R: Robot> Builder<R> {
    const ORIGIN: Origin = Origin { robot: R::NAME, node: "local" };

    pub(super) fn new() -> Self {
        let topics = R::topics();
        let mut system = SystemTopics::new(declared::<R>());
        let declared = R::all_topics(&topics).into_iter().chain(system.all()).map(|topic| topic.path());
        let declared = declared.chain(R::ACTUATORS.iter().map(|actuator| actuator.path));
        system.registry = Registry::new(declared);
        Self {
            options: R::options(),
            topics,
            system: Arc::new(system),
            parameters: R::PARAMETERS.iter().map(|parameter| parameter.default.into()).collect(),
            supervision: Supervision::default(),
            journal: None,
        }
    }

    /// The options of a component, at first as declared. They are validated at the start. An option that is bound to a
    /// parameter has that one's value, whatever is set here.
    pub fn options<C: Configurable<R>>(&mut self, component: C) -> &mut C::Options {
        component.options(&mut self.options)
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
        let value = value.into_value();
        if let Some(declared) = R::PARAMETERS.get(parameter.number()) {
            declared.check(&value)?;
        }
        if let Some(slot) = self.parameters.get_mut(parameter.number()) {
            *slot = value;
        }
        Ok(())
    }

    /// How patiently components that fail are started anew.
    pub fn supervision(&mut self) -> &mut Supervision {
        &mut self.supervision
    }

    /// Has all that comes in from outside written to `sink`, enough to run the robot again: see
    /// [`journal`](crate::journal).
    pub fn journal(&mut self, sink: impl Fn(Entry) + Send + Sync + 'static) {
        self.journal = Some(Journal::new(Arc::new(sink)));
    }

    /// Has the same published at `journal`, for a recorder: give its subscription room, since a journal of which lines were
    /// lost cannot be replayed beyond them.
    pub fn publish_journal(&mut self) {
        let system = Arc::clone(&self.system);
        self.journal(move |entry| {
            let stamp = Stamp { monotonic_time: entry.time, origin: Self::ORIGIN, ..Stamp::default() };
            system.journal.publish(&stamp.message(JournalLine::from(&entry)));
        });
    }

    /// Subscribes, with room for 1024 messages.
    pub fn subscribe<P: Publisher<R>>(&self, publisher: P) -> Subscription<P::Payload> {
        self.subscribe_with(publisher, Overflow::default())
    }

    /// Subscribes, and says what happens when the subscriber is slow.
    pub fn subscribe_with<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        publisher.topic(&self.topics, &self.system).subscribe(overflow)
    }

    /// Subscribes to messages of any payload, by path; with names of payload types, to those only. (Commands to
    /// actuators can be subscribed to once the robot runs.)
    pub fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        overflow: Overflow,
    ) -> DynamicSubscription {
        let topics: Vec<&dyn AnyTopic> = R::all_topics(&self.topics).into_iter().chain(self.system.all()).collect();
        self.system.registry.subscribe(&topics, select, &payloads.into(), overflow)
    }

    /// Starts the robot in real time: each sensor on a thread of its own.
    ///
    /// # Errors
    /// Names the component that cannot start; those that had started are stopped in order.
    pub fn start(self) -> Result<Running<R>, StartError> {
        let (machine, sources) = self.assemble(Clock::real(), false)?;
        Running::start(machine, sources)
    }

    /// Starts the robot on virtual time, from zero or from the first stamp of a recording: nothing moves until the caller
    /// runs it.
    ///
    /// # Errors
    /// Names the component that cannot start; those that had started are stopped in order.
    pub fn simulate(self) -> Result<Simulation<R>, StartError> {
        let (machine, sources) = self.assemble(Clock::virtual_at(MonotonicTime::ZERO), false)?;
        Ok(Simulation::new(machine, sources))
    }

    /// Prepares a robot to be run again from a journal, on virtual time and without sensors, services and actuators. Options
    /// must be as they were.
    ///
    /// # Errors
    /// Names the component that cannot start.
    pub fn replay(self) -> Result<Replay<R>, StartError> {
        let (machine, _) = self.assemble(Clock::virtual_at(MonotonicTime::from_nanos(i64::MIN)), true)?;
        Ok(Replay::new(machine))
    }

    /// Dropping what has started stops it in order.
    fn assemble(self, clock: Clock, is_replay: bool) -> Result<Assembled<R>, StartError> {
        let origin = Self::ORIGIN;
        let commands = R::commands(&self.options);
        let parameters = ParameterValues::new(self.parameters);
        let journal = self.journal.filter(|_| !is_replay);
        let control = Control::new(
            declared::<R>(),
            self.system,
            clock.clone(),
            origin,
            commands,
            parameters,
            journal.clone(),
        );
        if let Err((path, message)) = control.check_commands() {
            return Err(StartError::component(path, Fault::new(message)));
        }
        let startup = Startup::new::<R>(clock, origin, control, self.supervision).with_journal(journal);
        let startup = if is_replay { startup.for_replay() } else { startup };
        let wiring = Arc::new(R::wire(self.topics, &self.options, &startup));
        startup.set_directory(Arc::new(Wired::<R>(Arc::downgrade(&wiring))));
        let sources = if is_replay { Vec::new() } else { R::sources(&wiring, &self.options, &startup) };
        match startup.refusal() {
            Some(error) => Err(error),
            None => Ok((Machine { wiring, startup }, sources)),
        }
    }
}

fn declared<R: Robot>() -> Declared {
    Declared { states: R::STATES, categories: R::CATEGORIES, commands: R::COMMANDS, parameters: R::PARAMETERS }
}

impl<R: Robot> fmt::Debug for Builder<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Builder").field(&R::NAME).finish()
    }
}
