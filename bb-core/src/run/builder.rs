//! A robot before it starts.

use super::bound::refused_by_bound;
use super::describe::describe;
use super::handle::{Configurable, ParameterHandle, Publisher};
use super::host::{RobotHost, WiredIslands};
use super::joints::known_joints;
use super::keeper::{Keeper, Kept};
use super::machine::Machine;
use super::running::STOP_WITHIN;
use super::source::Assembly;
use super::{Replay, Robot, Running, Simulation, Source, StartError, Supervision};
use crate::component::replacement::{Replacement, Replacements};
use crate::component::shared::SharedValues;
use crate::component::{Fault, Host, OptionsList};
use crate::control::{Control, Declared, Parts, SystemTopics};
use crate::declaration::{ParameterError, ParameterType, ParameterValues};
use crate::event::ParameterValue;
use crate::fault::caught;
use crate::joints::{JointSettings, Joints};
use crate::journal::{Entry, Event, Journal, Sink};
use crate::lifecycle::HostHandle;
use crate::message::{Origin, Stamp};
use crate::node::{Environment, EnvironmentParts, Mode, SharedNode, contained};
use crate::pubsub::{AnyTopic, DynamicSubscription, Overflow, Payloads, Registry, Select, Subscription};
use crate::schedule::{Agenda, Lane};
use crate::telemetry::{Telemetry, TelemetryEvent};
use crate::time::{Clock, MonotonicTime};
use std::collections::HashMap;
use std::fmt;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

/// The wiring with its estimators, and the sensors that feed it.
pub(super) type Assembled<R> = (Machine<R>, Vec<Box<dyn Source>>);

/// A robot that is assembled but not yet started. Options may still be changed, and a subscription made here misses
/// nothing.
pub struct Builder<R: Robot> {
    pub(super) options: OptionsList,
    topics: R::Topics,
    system: Arc<SystemTopics>,
    pub(super) parameters: Vec<ParameterValue>,
    supervision: Supervision,
    joints: JointSettings,
    journal: Option<Sink>,
    telemetry: Telemetry,
    pub(super) replacements: HashMap<&'static str, Replacement>,
    pub(super) kept: Option<Kept>,
    node: &'static str,
}

impl<R: Robot> Builder<R> {
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
            joints: JointSettings::default(),
            journal: None,
            telemetry: Telemetry::default(),
            replacements: HashMap::new(),
            kept: None,
            node: "local",
        }
    }

    /// The options of a component, initially as declared. They are validated at the start. An option bound to a
    /// parameter takes that parameter's value, whatever is set here.
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
        let Some(declared) = R::PARAMETERS.get(parameter.number()) else { return Ok(()) };
        let value = value.into_value();
        declared.check(&value)?;
        let mut parameters = self.parameters.clone();
        if let Some(slot) = parameters.get_mut(parameter.number()) {
            *slot = value;
        }
        if let Some(message) = refused_by_bound::<R>(
            &mut self.options,
            |path| self.replacements.contains_key(path),
            &parameters,
            declared.path,
        ) {
            return Err(ParameterError { path: declared.path.to_owned(), message });
        }
        self.parameters = parameters;
        Ok(())
    }

    /// How components that fail are restarted.
    pub fn supervision(&mut self) -> &mut Supervision {
        &mut self.supervision
    }

    /// How much history of joint states is kept, and for how long a state is valid.
    pub fn joints(&mut self) -> &mut JointSettings {
        &mut self.joints
    }

    /// Names the machine or process that runs the robot: the `node` of its messages' origin. `local` unless it is set.
    pub fn node(&mut self, name: &'static str) -> &mut Self {
        self.node = name;
        self
    }

    /// Hands every processed entry to `sink`, enough to run the robot again: see [`journal`](crate::journal). The
    /// sink is called on its own thread, on virtual time on the caller's. A slow sink makes sensors and other outside
    /// producers wait. A sink that hangs for 2 s ends the journal, which is reported.
    pub fn journal(&mut self, sink: impl Fn(Entry) + Send + Sync + 'static) {
        self.journal = Some(Arc::new(sink));
    }

    /// Publishes the journal at `journal`, for a recorder. Give its subscription room: a journal that lost lines
    /// cannot be replayed beyond the gap.
    pub fn publish_journal(&mut self) {
        let system = Arc::clone(&self.system);
        let origin = Origin { robot: R::NAME, node: self.node };
        self.journal(move |entry| {
            let stamp = Stamp { monotonic_time: entry.time, origin, ..Stamp::default() };
            system.journal.publish(&stamp.message(entry));
        });
    }

    /// Attaches a telemetry handler, which gets the robot's name with every event. Inputs, outputs, latencies and
    /// drops are reported on the thread that runs the estimator, so the handler must be quick; transitions and faults
    /// on a separate thread.
    pub fn telemetry(&mut self, handler: impl Fn(&'static str, &TelemetryEvent) + Send + Sync + 'static) {
        self.telemetry.add(Arc::new(handler));
    }

    /// Subscribes, with room for 1024 messages.
    pub fn subscribe<P: Publisher<R>>(&self, publisher: P) -> Subscription<P::Payload> {
        self.subscribe_with(publisher, Overflow::default())
    }

    /// Subscribes, with `overflow` for a subscriber that is slow.
    pub fn subscribe_with<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        publisher.topic(&self.topics, &self.system).subscribe(overflow)
    }

    /// Subscribes to messages of any payload, by path; with names of payload types, only to those. (Commands to
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

    /// Starts the robot in real time, with one thread per sensor.
    ///
    /// # Errors
    /// Names the component that cannot start. Components that had started are stopped in order.
    pub fn start(self) -> Result<Running<R>, StartError> {
        let (machine, sources) = self.assemble(Clock::real(), Mode::Real)?;
        Running::start(machine, sources)
    }

    /// Starts the robot on virtual time, from zero or from the first stamp of a recording: nothing moves until the caller
    /// runs it.
    ///
    /// # Errors
    /// Names the component that cannot start. Components that had started are stopped in order.
    pub fn simulate(self) -> Result<Simulation<R>, StartError> {
        let (machine, sources) = self.assemble(Clock::virtual_at(MonotonicTime::ZERO), Mode::Virtual)?;
        Ok(Simulation::new(machine, sources))
    }

    /// Prepares to replay a robot from a journal: on virtual time, without sensors, services, actuators or the code
    /// of commands. Options of estimators must be the same as in the recorded run.
    ///
    /// # Errors
    /// Names the component that cannot start.
    pub fn replay(self) -> Result<Replay<R>, StartError> {
        let (machine, _) = self.assemble(Clock::virtual_at(MonotonicTime::from_nanos(i64::MIN)), Mode::Replay)?;
        Ok(Replay::new(machine))
    }

    /// Dropping the result stops in order what has started.
    fn assemble(mut self, clock: Clock, mode: Mode) -> Result<Assembled<R>, StartError> {
        let origin = Origin { robot: R::NAME, node: self.node };
        let journal = if mode == Mode::Replay { None } else { self.journal.take() };
        let wall_offset_nanos = clock.wall_offset_nanos();
        let journal = journal.map(|sink| Journal::new(sink, wall_offset_nanos));
        let telemetry = (!self.telemetry.is_empty()).then(|| std::mem::take(&mut self.telemetry));
        let nodes: Box<[SharedNode]> =
            R::ESTIMATORS.iter().enumerate().map(|(number, declared)| SharedNode::new(number, declared)).collect();
        let control = Control::new(Parts {
            declared: declared::<R>(),
            mode,
            topics: Arc::clone(&self.system),
            clock: clock.clone(),
            origin,
            commands: R::commands(&self.options),
            parameters: ParameterValues::new(std::mem::take(&mut self.parameters)),
            supervision: self.supervision,
            nodes: nodes.clone(),
            journal: journal.clone(),
            telemetry: telemetry.clone(),
        });
        if let Err((path, message)) = control.check_commands() {
            return Err(StartError::component(path, Fault::new(message)));
        }
        let start = clock.now();
        let joints = known_joints::<R>(&self.topics, self.joints, clock.clone());
        let joints: Joints = match joints {
            Ok(joints) => joints,
            Err(error) => {
                return Err(StartError::component(R::NAME, Fault::from(error)));
            }
        };
        let replacements: Replacements = Arc::new(std::mem::take(&mut self.replacements));
        let parts = EnvironmentParts {
            mode,
            joints: joints.clone(),
            replacements: Arc::clone(&replacements),
            origin,
            overseer: Arc::new(control.clone()),
            supervision: self.supervision,
            agenda: Agenda::new(control.bell().clone()),
            pool: control.pool().clone(),
            journal: journal.clone(),
            telemetry,
            start,
            clock: clock.clone(),
        };
        let environment = Environment::new(parts, nodes);
        let place = Arc::new(OnceLock::new());
        let host: Arc<dyn Host> = Arc::new(RobotHost::<R> {
            control: control.clone(),
            journal: journal.clone(),
            door: environment.door().clone(),
            joints,
            shared: SharedValues::default(),
            replacements,
            wiring: Arc::clone(&place),
        });
        control.set_host(&host);
        control.set_islands(Box::new(WiredIslands::<R>(Arc::clone(&place))));
        let drained = Arc::clone(&place);
        environment.set_drain(move |environment, island| {
            let wiring: Option<Arc<R::Wiring>> = drained.get().and_then(std::sync::Weak::upgrade);
            if let (Some(wiring), Some(find)) = (wiring, R::ISLANDS.get(island)) {
                let island = find(&wiring);
                // The component is unknown, for example if the panic is in the code of a payload in an inbox.
                if let Err(failed) = contained(environment, || island.drain(&wiring)) {
                    tracing::error!(fault = %failed.fault, "an island was left");
                }
            }
        });
        let mut facts = describe::<R>(&self.topics, &control);
        facts.push(format!("supervision: {:?}", self.supervision));
        let assembly = Assembly {
            environment: environment.clone(),
            control: control.clone(),
            host: HostHandle(Arc::clone(&host)),
        };
        // Makes safe what the others have started in `init`.
        let abandon = |path, fault| {
            control.begin_stop();
            control.wait_until_disarmed();
            control.drop_hooks();
            control.pool().close();
            // What hangs is left running. There is no report; the error says why the robot does not start.
            let _ = control.pool().left(Lane::User, Instant::now() + STOP_WITHIN);
            StartError::component(path, fault)
        };
        let topics = std::mem::replace(&mut self.topics, R::topics());
        let options = &self.options;
        let is_replay = mode == Mode::Replay;
        if let Some(kept) = self.kept.as_ref().filter(|_| !is_replay) {
            kept.note(&control);
        }
        let wired = caught(|| {
            let wiring = Arc::new(R::wire(topics, options, &assembly));
            // It is set once.
            let _ = place.set(Arc::downgrade(&wiring));
            let sources = if is_replay { Vec::new() } else { R::sources().open(&wiring, options, &assembly) };
            Ok((wiring, sources))
        });
        if let Some(refusal) = environment.take_refusal() {
            let error = abandon(refusal.path, refusal.fault);
            return Err(error);
        }
        // Each component's code is guarded separately, with its path. This is for anything else.
        let (wiring, sources) = match wired {
            Ok(wired) => wired,
            Err(failed) => {
                let error = abandon(R::NAME, failed.fault);
                return Err(error);
            }
        };
        if let Some(journal) = &journal {
            let declaration = facts.iter().cloned().chain(environment.facts()).collect();
            let begin = Event::Begin { declaration, wall_offset_nanos, is_virtual: mode == Mode::Virtual };
            journal.begin(start, begin);
            if mode == Mode::Real
                && let Err(error) = journal.start()
            {
                let error = abandon("journal", Fault::from(error));
                return Err(error);
            }
        }
        for fact in facts {
            environment.add_declared_fact(fact);
        }
        let shared = sources.iter().map(|source| source.shared()).collect();
        let kept = if is_replay { None } else { self.kept.take() };
        let keeper = match kept.map(|kept| Keeper::start(kept, &control)) {
            None => None,
            Some(Ok(keeper)) => Some(keeper),
            Some(Err(fault)) => {
                let error = abandon(super::keeper::PATH, fault);
                return Err(error);
            }
        };
        let machine = Machine {
            wiring,
            environment,
            control,
            host,
            sources: Mutex::new(shared),
            has_ended: AtomicBool::new(false),
            last_report: OnceLock::new(),
            keeper: Mutex::new(keeper),
        };
        Ok((machine, sources))
    }
}

fn declared<R: Robot>() -> Declared {
    Declared {
        topology: R::TOPOLOGY,
        states: R::STATES,
        categories: R::CATEGORIES,
        commands: R::COMMANDS,
        parameters: R::PARAMETERS,
        estimators: R::ESTIMATORS,
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
