//! A robot before it starts.

use super::handle::{Configurable, Publisher};
use super::machine::Machine;
use super::{Robot, Running, Simulation, Source, StartError, Startup};
use crate::pubsub::{Overflow, Subscription};
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
}

impl<R: Robot> Builder<R> {
    pub(super) fn new() -> Self {
        Self { options: R::options(), topics: R::topics() }
    }

    /// The options of a component, at first as declared. They are validated at the start.
    pub fn options<C: Configurable<R>>(&mut self, component: C) -> &mut C::Options {
        component.options(&mut self.options)
    }

    /// Subscribes, with room for 1024 messages.
    pub fn subscribe<P: Publisher<R>>(&self, publisher: P) -> Subscription<P::Payload> {
        self.subscribe_with(publisher, Overflow::default())
    }

    /// Subscribes, and says what happens when the subscriber is slow.
    pub fn subscribe_with<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        publisher.topic(&self.topics).subscribe(overflow)
    }

    /// Starts the robot in real time: each sensor on a thread of its own.
    ///
    /// # Errors
    /// Names the component that cannot start; those that had started are stopped in order.
    pub fn start(self) -> Result<Running<R>, StartError> {
        let startup = Startup::new(Clock::real(), R::NAME);
        let (machine, sources) = self.assemble(startup)?;
        Running::start(machine, sources)
    }

    /// Starts the robot on virtual time, from zero or from the first stamp of a recording: nothing moves until the caller
    /// runs it.
    ///
    /// # Errors
    /// Names the component that cannot start; those that had started are stopped in order.
    pub fn simulate(self) -> Result<Simulation<R>, StartError> {
        let startup = Startup::new(Clock::virtual_at(MonotonicTime::ZERO), R::NAME);
        let (machine, sources) = self.assemble(startup)?;
        Ok(Simulation::new(machine, sources))
    }

    /// Dropping what has started stops it in order.
    fn assemble(self, startup: Startup) -> Result<Assembled<R>, StartError> {
        let wiring = Arc::new(R::wire(self.topics, &self.options, &startup));
        let sources = R::sources(&wiring, &self.options, &startup);
        match startup.refusal() {
            Some(error) => Err(error),
            None => Ok((Machine { wiring, startup }, sources)),
        }
    }
}

impl<R: Robot> fmt::Debug for Builder<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Builder").field(&R::NAME).finish()
    }
}
