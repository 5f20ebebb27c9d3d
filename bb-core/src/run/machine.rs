//! What all kinds of run share: the wiring and the operations on it.

use super::handle::{ActuatorHandle, CommandHandle, ParameterHandle, Publisher};
use super::keeper::Keeper;
use super::source::SharedSource;
use super::visit::Visitable;
use super::{ActuatorError, Report, Robot, SensorHandle};
use crate::component::{Actuator, Bus, Command, Fault, HandleCall, HandleCast, Host, Permit, RequestCodec, Sensor};
use crate::control::{Control, Execution, ReportedFault, Summary};
use crate::declaration::{ParameterError, ParameterType};
use crate::event::Refusal;
use crate::journal::{Event, ParameterEntry, RequestKind};
use crate::message::Stamp;
use crate::node::{
    AnyIsland, CallError, Environment, Node, NodeEntry, Turn, contained_outside, know_calls, know_casts,
};
use crate::pubsub::{AnyTopic, DynamicSubscription, Overflow, Payloads, Select, Subscription};
use crate::time::MonotonicTime;
use std::any::Any;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

pub(super) struct Machine<R: Robot> {
    pub(super) wiring: Arc<R::Wiring>,
    pub(super) environment: Environment,
    pub(super) control: Control,
    pub(super) host: Arc<dyn Host>,
    pub(super) sources: Mutex<Vec<SharedSource>>,
    /// The threads of the robot have no work left.
    pub(super) has_ended: AtomicBool,
    /// Its report at the end.
    pub(super) last_report: OnceLock<Report>,
    /// Taken at the end.
    pub(super) keeper: Mutex<Option<Keeper>>,
}

/// How many one-way requests may wait for an estimator; further ones are refused.
const MOST_CASTS: u32 = 1024;

impl<R: Robot> Machine<R> {
    pub(super) fn subscribe<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        publisher.topic(R::wired_topics(&self.wiring), self.control.topics()).subscribe(overflow)
    }

    pub(super) fn subscribe_any<'a>(
        &self,
        select: Select<'_>,
        payloads: impl Into<Payloads<'a>>,
        overflow: Overflow,
    ) -> DynamicSubscription {
        self.control.topics().registry.subscribe(&self.topics(), select, &payloads.into(), overflow)
    }

    pub(super) fn topics(&self) -> Vec<&dyn AnyTopic> {
        let actuators = R::all_actuators(&self.wiring).into_iter().map(|actuator| actuator.any_topic());
        let robot = R::all_topics(R::wired_topics(&self.wiring)).into_iter().chain(actuators);
        robot.chain(self.control.topics().all()).collect()
    }

    pub(super) fn bus(&self) -> Bus {
        Bus::new(Arc::clone(&self.host), Permit::UNLIMITED)
    }

    pub(super) fn publish<S: Sensor>(&self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
        let Some(_inside) = self.environment.door().enter() else { return };
        let clock = self.environment.clock();
        let stamp = Stamp {
            monotonic_time: time,
            wall_time: clock.wall_at(time),
            origin: self.environment.origin(),
            ..Stamp::default()
        };
        let publish = || sensor.publish(&self.wiring, stamp, payload, clock.now());
        contained_outside(&self.environment, publish);
    }

    pub(super) fn call<V: Visitable<R>, Q>(
        &self,
        estimator: V,
        request: Q,
    ) -> Result<<V::Estimator as HandleCall<Q>>::Response, Fault>
    where
        V::Estimator: HandleCall<Q>,
    {
        self.check_requests(estimator.number())?;
        know_calls::<V::Estimator, Q>();
        let recorded = RequestCodec::record(RequestKind::Call, <V::Estimator as HandleCall<Q>>::RECORD, &request);
        let is_unrecorded = recorded.bytes.is_none();
        let mut request = Some(request);
        let mut response = None;
        let mut error = None;
        let mut call = |node: &mut dyn Any, turn: &Turn<'_>, emitted: &mut dyn Any| {
            let node = node.downcast_mut::<Node<V::Estimator>>()?;
            let emitted = emitted.downcast_mut()?;
            let (answer, stamp) = node.call(request.take()?, is_unrecorded, turn, emitted);
            response = Some(answer);
            stamp
        };
        let now = self.environment.clock().now();
        let number = estimator.number();
        let line = Event::Request { estimator: number, request: recorded };
        let declaration = self.environment.node(number).declaration();
        let island = self.island(declaration.island);
        contained_outside(&self.environment, || {
            error = island.and_then(|island| island.visit(&self.wiring, now, number, line, &mut call).err());
        });
        let path = declaration.path;
        response.unwrap_or_else(|| {
            Err(Fault::new(match error {
                Some(CallError::Busy) => format!("{path} has been busy for 5 s and has not answered"),
                _ => format!(
                    "{path} cannot be asked by code that an estimator's message has woken, which would wait for \
                     itself: use `cast`, or another thread"
                ),
            }))
        })
    }

    pub(super) fn cast<V: Visitable<R>, Q: Send + 'static>(&self, estimator: V, request: Q) -> Result<(), Fault>
    where
        V::Estimator: HandleCast<Q>,
    {
        self.check_requests(estimator.number())?;
        know_casts::<V::Estimator, Q>();
        let node = self.environment.node(estimator.number());
        let path = node.declaration().path;
        if let Some(stopped) = node.stopped().filter(|stopped| stopped.for_good) {
            return Err(Fault::new(format!("{path} does not run any more: {}", stopped.reason)));
        }
        if self.has_ended.load(Ordering::Acquire) {
            return Err(Fault::new(format!("{path} does not run any more")));
        }
        if !node.begin_cast(MOST_CASTS) {
            return Err(Fault::new(format!("too many requests wait for {path}")));
        }
        let (request, handle) = Node::<V::Estimator>::cast(request);
        let entry = NodeEntry::Cast { request, handle: Some(handle) };
        if let Some(island) = self.island(node.declaration().island) {
            island.post(&self.wiring, self.environment.clock().now(), estimator.number(), entry);
        }
        Ok(())
    }

    /// A replacement does not implement the requests of the estimator with that number.
    fn check_requests(&self, estimator: usize) -> Result<(), Fault> {
        let path = self.environment.node(estimator).declaration().path;
        match self.environment.replacement(path) {
            Some(_) => Err(Fault::new(format!("{path} is replaced, and its replacement takes no requests"))),
            None => Ok(()),
        }
    }

    pub(super) fn command<C: Command>(
        &self,
        command: CommandHandle<R, C>,
        arguments: C::Arguments,
    ) -> Result<Execution<C::Output>, Refusal> {
        self.control.execute(command.number(), Box::new(arguments))
    }

    pub(super) fn actuate<A: Actuator>(
        &self,
        actuator: ActuatorHandle<R, A>,
        command: A::Command,
    ) -> Result<(), ActuatorError> {
        actuator.node(&self.wiring).send(command)
    }

    pub(super) fn parameter<T: ParameterType>(&self, parameter: ParameterHandle<R, T>) -> T {
        self.control.parameters().get(parameter.number())
    }

    pub(super) fn set_parameter<T: ParameterType>(
        &self,
        parameter: ParameterHandle<R, T>,
        value: T,
    ) -> Result<(), ParameterError> {
        let entry = ParameterEntry { parameter: parameter.number(), value: value.into_value() };
        self.control.set_parameters(vec![entry], &Permit::UNLIMITED)
    }

    pub(super) fn shared_sources(&self) -> Vec<SharedSource> {
        self.sources.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn islands(&self) -> impl Iterator<Item = &dyn AnyIsland<R::Wiring>> {
        R::ISLANDS.iter().map(|find| find(&self.wiring))
    }

    pub(super) fn island(&self, number: usize) -> Option<&dyn AnyIsland<R::Wiring>> {
        R::ISLANDS.get(number).map(|find| find(&self.wiring))
    }

    /// Has all estimators start.
    pub(super) fn start_islands(&self, now: MonotonicTime) {
        for island in self.islands() {
            island.start(&self.wiring, now);
        }
    }

    /// The estimator whose callback an island runs.
    pub(super) fn path_of_busy(&self, island: &dyn AnyIsland<R::Wiring>) -> &'static str {
        let running = island.busy(&self.wiring).and_then(|(_, estimator)| R::ESTIMATORS.get(estimator));
        running.map_or(island.declaration().name, |estimator| estimator.path)
    }

    /// On virtual time, after an outside action: runs disarm callbacks left by an actuator's own code, and hands
    /// lines of the journal to its sink.
    pub(super) fn settle(&self) {
        if !self.control.is_virtual() {
            return;
        }
        while self.control.run_pending_hooks() {}
        if let Some(journal) = self.environment.journal() {
            journal.flush();
        }
    }

    /// The report so far; the last report once it has ended.
    pub(super) fn report(&self) -> Report {
        match self.last_report.get() {
            Some(report) => report.clone(),
            None => self.control.between_entries(|control| self.report_of(control)),
        }
    }

    pub(super) fn report_of(&self, control: Summary) -> Report {
        let topics = self.topics();
        let estimators: Vec<_> = self.environment.nodes().iter().map(|node| node.statistics()).collect();
        let made = self.control.topics().registry.statistics();
        let sources = self.sources.lock().unwrap_or_else(PoisonError::into_inner);
        let Summary { commands, state, safety, faults, all_faults } = control;
        Report {
            topics: topics.iter().map(|topic| topic.statistics()).chain(made).collect(),
            estimators,
            sources: sources.iter().map(SharedSource::statistics).collect(),
            actuators: R::all_actuators(&self.wiring).into_iter().map(|actuator| actuator.statistics()).collect(),
            commands,
            joints: self.environment.joints().statistics(),
            state,
            safety,
            faults,
            all_faults,
        }
    }

    /// Records a fault of a component that did not return.
    pub(super) fn fault(&self, path: &'static str, message: String) -> ReportedFault {
        let now = self.control.note_fault_now(path, message.clone());
        ReportedFault { path, message, count: 1, first_time: now, last_time: now }
    }
}
