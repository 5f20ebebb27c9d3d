//! What real and simulated runs share: the wiring, and what can be asked of it.

use super::handle::{ActuatorHandle, CommandHandle, ParameterHandle, Publisher, Visit, Visitable};
use super::{ActuatorError, Report, Robot, SensorHandle, Startup};
use crate::component::{Actuator, Fault, HandleCall, HandleCast, Sensor};
use crate::control::{Command, Execution, ParameterError, ParameterType, Refusal};
use crate::message::Stamp;
use crate::node::{AnyIsland, Node};
use crate::pubsub::{AnyTopic, DynamicSubscription, Overflow, Payloads, Registry, Select, Subscription};
use crate::time::MonotonicTime;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub(super) struct Machine<R: Robot> {
    pub(super) wiring: Arc<R::Wiring>,
    pub(super) startup: Startup,
}

impl<R: Robot> Machine<R> {
    pub(super) fn subscribe<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        publisher.topic(R::wired_topics(&self.wiring), self.startup.control.topics()).subscribe(overflow)
    }

    pub(super) fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        overflow: Overflow,
    ) -> DynamicSubscription {
        self.registry().subscribe(&self.topics(), select, &payloads.into(), overflow)
    }

    fn registry(&self) -> &Registry {
        &self.startup.control.topics().registry
    }

    /// All but those made at run time.
    fn topics(&self) -> Vec<&dyn AnyTopic> {
        let actuators = R::all_actuators(&self.wiring).into_iter().map(|actuator| actuator.any_topic());
        let robot = R::all_topics(R::wired_topics(&self.wiring)).into_iter().chain(actuators);
        robot.chain(self.startup.control.topics().all()).collect()
    }

    pub(super) fn publish<S: Sensor>(&self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
        let wall_time = self.startup.clock.wall_at(time);
        let origin = self.startup.origin;
        let stamp = Stamp { monotonic_time: time, wall_time, origin, ..Stamp::default() };
        sensor.publish(&self.wiring, stamp, payload, self.startup.clock.now());
    }

    pub(super) fn call<V: Visitable<R>, Q>(
        &self,
        estimator: V,
        request: Q,
    ) -> Result<<V::Estimator as HandleCall<Q>>::Response, Fault>
    where
        V::Estimator: HandleCall<Q>,
    {
        let (mut request, mut response) = (Some(request), None);
        let now = self.startup.clock.now();
        let mut visit = |node: &mut Node<V::Estimator>, emitted: &mut Option<_>| {
            let (answer, stamp) = node.call(request.take()?, now, emitted);
            response = Some(answer);
            stamp
        };
        estimator.visit(&self.wiring, now, Visit::new(&mut visit));
        response.unwrap_or_else(|| {
            let path = self.startup.node(estimator.number()).declaration().path;
            Err(Fault::new(format!(
                "{path} cannot be asked by code that an estimator's message has woken, which would wait for itself: use \
                 `cast`, or another thread"
            )))
        })
    }

    pub(super) fn cast<V: Visitable<R>, Q: Send + 'static>(&self, estimator: V, request: Q) -> Result<(), Fault>
    where
        V::Estimator: HandleCast<Q>,
    {
        let node = self.startup.node(estimator.number());
        node.leave_cast(Node::<V::Estimator>::cast(request))?;
        if let Some(island) = self.island(node.declaration().island) {
            island.wake(&self.wiring, self.startup.clock.now());
        }
        Ok(())
    }

    pub(super) fn command<C: Command>(
        &self,
        command: CommandHandle<R, C>,
        arguments: C::Arguments,
    ) -> Result<Execution<C::Output>, Refusal> {
        self.startup.control.execute(command.number(), Box::new(arguments), self.startup.clock.now())
    }

    pub(super) fn actuate<A: Actuator>(
        &self,
        actuator: ActuatorHandle<R, A>,
        command: A::Command,
    ) -> Result<(), ActuatorError> {
        actuator.node(&self.wiring).send(command)
    }

    pub(super) fn parameter<T: ParameterType>(&self, parameter: ParameterHandle<R, T>) -> T {
        self.startup.control.parameters().get(parameter.number())
    }

    pub(super) fn set_parameter<T: ParameterType>(
        &self,
        parameter: ParameterHandle<R, T>,
        value: T,
    ) -> Result<(), ParameterError> {
        let setter = self.startup.control.setter();
        self.startup.control.set_parameter(parameter.number(), value.into_value(), setter)
    }

    /// Wakes the estimators of an island.
    pub(super) fn wake(&self, island: usize, now: MonotonicTime) {
        if let Some(island) = self.island(island) {
            island.wake(&self.wiring, now);
        }
    }

    pub(super) fn island(&self, number: usize) -> Option<&dyn AnyIsland<R::Wiring>> {
        R::ISLANDS.get(number).map(|find| find(&self.wiring))
    }

    pub(super) fn report(&self) -> Report {
        let mut topics: Vec<_> = self.topics().iter().map(|topic| topic.statistics()).collect();
        topics.extend(self.registry().topics().iter().map(|topic| topic.statistics()));
        let estimators: Vec<_> = self.startup.nodes().iter().map(|node| node.statistics()).collect();
        let (faults, all_faults) = self.startup.faults.all();
        Report {
            topics,
            estimators,
            commands: self.startup.control.statistics(),
            state: self.startup.control.state(),
            safety: self.startup.control.safety(),
            faults,
            all_faults,
        }
    }

    /// Cancels commands and disarms, tells the subscribers that no more will come, and stops the estimators and actuators.
    /// What is still busy `within` so long after that is left behind and reported as a fault.
    pub(super) fn terminate(&self, within: Duration) {
        for path in self.startup.control.stop(self.startup.clock.now()) {
            self.fault(path, "did not come back when the robot stopped");
        }
        let deadline = Instant::now() + within;
        let left = || deadline.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        for topic in self.topics() {
            topic.close();
        }
        self.registry().close();
        for island in (0..R::ISLANDS.len()).filter_map(|number| self.island(number)) {
            if !island.terminate(&self.wiring, left()) {
                self.fault(island.name(), "did not come back from its input in time");
            }
        }
        for actuator in R::all_actuators(&self.wiring) {
            if !actuator.terminate(left()) {
                self.fault(actuator.path(), "did not come back from its command, or from disarming, in time");
            }
        }
    }

    /// What a fault's list says of a component that did not come back.
    pub(super) fn fault(&self, path: &'static str, message: &str) {
        self.startup.faults.add(path, message.into());
    }
}
