//! A robot before it starts, without its type: its settings, and how it is assembled from them.
//!
//! It is assembled in stages, each of which makes what the next ones need: [`Assembling::new`] the control state, the
//! environment of the islands and the robot as components see it; [`Assembling::make`] the components, in whose `init` user
//! code runs for the first time; then the journal begins, and the store of parameters. [`Assembling`] owns all that was made. It
//! ends in [`Assembling::complete`], or at an error in any stage in [`Assembling::abandon`], which makes safe what components have
//! started and takes it down.

use super::bound::refused_by_bound;
use super::describe::describe;
use super::host::{RobotHost, WiredIslands};
use super::joints::known_joints;
use super::keeper::{Keeper, Kept, PATH as KEEPER};
use super::machine::Machine;
use super::running::STOP_WITHIN;
use super::source::{Assembly, OpenSources};
use super::wired::{Place, Unwired, Wired};
use super::{StartError, Supervision};
use crate::component::replacement::{Replacement, Replacements};
use crate::component::shared::SharedValues;
use crate::component::{Bus, Caller, Fault, Host, OptionsList};
use crate::control::{Control, Parts, SystemTopics};
use crate::declaration::{ParameterError, ParameterValues, RobotDeclaration};
use crate::event::ParameterValue;
use crate::fault::{Failed, caught, discard, guarded, log_panic};
use crate::joints::JointSettings;
use crate::journal::{Event, Journal, Sink};
use crate::message::{Origin, Stamp};
use crate::node::{Environment, EnvironmentParts, Mode, SharedNode};
use crate::pubsub::{AnyTopic, Delivery, DynamicSubscription, Payloads, Registry, Select};
use crate::schedule::{Agenda, Lane};
use crate::telemetry::{Handler, Telemetry};
use crate::time::{Clock, WallTime};
use bb_message::__private::Sorted;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, Weak};
use std::time::Instant;

/// The settings of a robot that has not started.
pub(super) struct Draft {
    pub(super) robot: &'static RobotDeclaration,
    /// The options as declared.
    pub(super) declared_options: fn() -> OptionsList,
    pub(super) options: OptionsList,
    pub(super) system: Arc<SystemTopics>,
    pub(super) parameters: Vec<ParameterValue>,
    pub(super) supervision: Supervision,
    pub(super) joints: JointSettings,
    pub(super) journal: Option<Sink>,
    pub(super) telemetry: Vec<Handler>,
    pub(super) replacements: Sorted<&'static str, Replacement>,
    pub(super) kept: Option<Kept>,
    pub(super) node: &'static str,
}

impl Draft {
    pub(super) fn new(
        robot: &'static RobotDeclaration,
        declared_options: fn() -> OptionsList,
        unwired: &dyn Unwired,
    ) -> Self {
        let mut system = SystemTopics::new(robot);
        let mut topics = unwired.topics();
        topics.extend(system.all());
        system.registry = Registry::new(topics.iter().map(|topic| topic.path()));
        Self {
            robot,
            declared_options,
            options: declared_options(),
            system: Arc::new(system),
            parameters: robot.parameters.iter().map(|parameter| parameter.default.into()).collect(),
            supervision: Supervision::default(),
            joints: JointSettings::default(),
            journal: None,
            telemetry: Vec::new(),
            replacements: Sorted::default(),
            kept: None,
            node: "local",
        }
    }

    /// Sets the parameter with that number.
    pub(super) fn set_parameter(&mut self, number: usize, value: ParameterValue) -> Result<(), ParameterError> {
        let Some(declared) = self.robot.parameters.get(number) else { return Ok(()) };
        declared.check(&value)?;
        let mut parameters = self.parameters.clone();
        if let Some(slot) = parameters.get_mut(number) {
            *slot = value;
        }
        let is_replaced = |path: &str| self.replacements.get(path).is_some();
        let refused = refused_by_bound(self.robot, &mut self.options, &is_replaced, &parameters, declared.path);
        if let Some(message) = refused {
            return Err(ParameterError { path: declared.path.to_owned(), message });
        }
        self.parameters = parameters;
        Ok(())
    }

    pub(super) fn publish_journal(&mut self) {
        let system = Arc::clone(&self.system);
        let origin = self.origin();
        let wall_offset_nanos = AtomicI64::new(0);
        self.journal = Some(Arc::new(move |entry| {
            if let Some(nanos) = entry.wall_offset_nanos() {
                wall_offset_nanos.store(nanos, Ordering::Relaxed);
            }
            let nanos = entry.time.as_nanos().saturating_add(wall_offset_nanos.load(Ordering::Relaxed));
            let wall_time = WallTime::from_unix_nanos(nanos);
            let stamp = Stamp { monotonic_time: entry.time, wall_time, origin, ..Stamp::default() };
            system.journal.publish(&stamp.message(entry));
        }));
    }

    /// Subscribes to `topics` and those that every robot has.
    pub(super) fn subscribe_any<'a>(
        &'a self,
        mut topics: Vec<&'a dyn AnyTopic>,
        select: Select<'_>,
        payloads: &Payloads<'_>,
        delivery: Delivery,
    ) -> DynamicSubscription {
        topics.extend(self.system.all());
        self.system.registry.subscribe(&topics, select, payloads, delivery)
    }

    fn origin(&self) -> Origin {
        Origin { robot: self.robot.name, node: self.node }
    }

    /// Makes the components. Dropping the result stops in order what has started.
    pub(super) fn assemble(
        mut self,
        unwired: &mut dyn Unwired,
        clock: Clock,
        mode: Mode,
    ) -> Result<(Arc<Machine>, OpenSources), StartError> {
        let mut assembling = Assembling::new(&mut self, unwired, clock, mode)?;
        match assembling.build(&self) {
            Ok((wired, keeper)) => Ok(assembling.complete(wired, keeper)),
            Err((path, fault)) => Err(assembling.abandon(path, fault)),
        }
    }
}

/// The path of what prevents the robot from starting, and the reason.
type Refused = (&'static str, Fault);

/// A robot that is being assembled, with all that was made for it.
struct Assembling<'a> {
    unwired: &'a mut dyn Unwired,
    robot: &'static RobotDeclaration,
    mode: Mode,
    control: Control,
    environment: Environment,
    host: Arc<dyn Host>,
    /// Weak, since components with a bus are part of the wiring.
    place: Place,
    /// The robot once it is assembled.
    machine: Arc<OnceLock<Weak<Machine>>>,
    wired: Option<Arc<Wired>>,
    sources: OpenSources,
    kept: Option<Kept>,
}

impl<'a> Assembling<'a> {
    fn new(draft: &mut Draft, unwired: &'a mut dyn Unwired, clock: Clock, mode: Mode) -> Result<Self, StartError> {
        let (robot, origin, supervision) = (draft.robot, draft.origin(), draft.supervision);
        let sink = if mode == Mode::Replay { None } else { draft.journal.take() };
        let journal = sink.map(|sink| Journal::new(sink, clock.wall_offset_nanos()));
        let handlers = std::mem::take(&mut draft.telemetry);
        let telemetry = (!handlers.is_empty()).then(|| Telemetry::new(handlers, robot.estimators));
        let mut nodes = Vec::new();
        for (number, declared) in robot.estimators.iter().enumerate() {
            nodes.push(SharedNode::new(number, declared));
        }
        let nodes: Box<[SharedNode]> = nodes.into();
        let control = Control::new(Parts {
            declared: robot,
            mode,
            topics: Arc::clone(&draft.system),
            clock: clock.clone(),
            origin,
            commands: unwired.commands(&draft.options),
            parameters: ParameterValues::new(std::mem::take(&mut draft.parameters)),
            supervision,
            nodes: nodes.clone(),
            journal: journal.clone(),
            telemetry: telemetry.clone(),
        });
        draft.system.registry.timer().set(control.alarms());
        if let Err((path, message)) = control.check_commands() {
            return Err(StartError::component(path, Fault::new(message)));
        }
        let joints = known_joints(robot, &unwired.topics(), draft.joints, clock.clone())
            .map_err(|error| StartError::component(robot.name, Fault::from(error)))?;
        let replacements: Replacements = Arc::new(std::mem::take(&mut draft.replacements));
        let parts = EnvironmentParts {
            mode,
            joints: joints.clone(),
            replacements: Arc::clone(&replacements),
            origin,
            overseer: Arc::new(control.clone()),
            supervision,
            agenda: Agenda::new(control.bell().clone()),
            pool: control.pool().clone(),
            journal: journal.clone(),
            telemetry,
            start: clock.now(),
            clock,
        };
        let environment = Environment::new(parts, nodes);
        let place = Place::default();
        let machine = Arc::default();
        let host: Arc<dyn Host> = Arc::new(RobotHost {
            robot,
            control: control.clone(),
            journal,
            door: environment.door().clone(),
            joints,
            shared: SharedValues::default(),
            replacements,
            wired: Arc::clone(&place),
            callers: Mutex::default(),
            machine: Arc::clone(&machine),
        });
        control.set_host(&host);
        control.set_islands(Box::new(WiredIslands { robot, wired: Arc::clone(&place) }));
        let drained = Arc::clone(&place);
        environment.set_drain(move |island| {
            let wired = drained.get().and_then(Weak::upgrade);
            if let Some(island) = wired.as_ref().and_then(|wired| wired.island(island))
                && let Err(fault) = guarded(|| island.drain())
            {
                log_panic("an island was left", &fault);
            }
        });
        let kept = if mode == Mode::Replay { None } else { draft.kept.take() };
        let (wired, sources) = (None, Vec::new());
        Ok(Self { unwired, robot, mode, control, environment, host, place, machine, wired, sources, kept })
    }

    /// The stages in which code of users runs.
    fn build(&mut self, draft: &Draft) -> Result<(Arc<Wired>, Option<Keeper>), Refused> {
        let mut facts = describe(self.robot, &self.unwired.topics(), &self.control);
        facts.push(format!("supervision: {:?}", draft.supervision));
        if let Some(kept) = &self.kept {
            kept.note(&self.control);
        }
        let made = self.make(&draft.options);
        if let Some(refusal) = self.environment.take_refusal() {
            return Err((refusal.path, refusal.fault));
        }
        // Each component's code is guarded separately, with its path. This is for anything else.
        let wired = made.map_err(|failed| (self.robot.name, failed.fault))?;
        self.begin_journal(&facts)?;
        for fact in facts {
            self.environment.add_declared_fact(fact);
        }
        let keeper = self.kept.take().map(|kept| Keeper::start(kept, &self.control));
        Ok((wired, keeper.transpose().map_err(|fault| (KEEPER, fault))?))
    }

    /// Makes the components.
    fn make(&mut self, options: &OptionsList) -> Result<Arc<Wired>, Failed> {
        let assembly = Assembly {
            environment: self.environment.clone(),
            control: self.control.clone(),
            host: Arc::clone(&self.host),
        };
        caught(|| {
            let wired = self.wired.insert(Arc::new(self.unwired.wire(options, &assembly)));
            // It is set once.
            let _ = self.place.set(Arc::downgrade(wired));
            if self.mode != Mode::Replay {
                self.sources = wired.sources().open(options, &assembly);
            }
            Ok(Arc::clone(wired))
        })
    }

    /// Writes the first line of the journal, and lets its sink begin.
    fn begin_journal(&self, facts: &[String]) -> Result<(), Refused> {
        let Some(journal) = self.environment.journal() else { return Ok(()) };
        let declaration = [facts, &self.environment.facts()].concat();
        let wall_offset_nanos = self.environment.clock().wall_offset_nanos();
        let begin = Event::Begin { declaration, wall_offset_nanos, is_virtual: self.mode == Mode::Virtual };
        journal.begin(self.environment.start(), begin);
        match self.mode {
            Mode::Real => journal.start().map_err(|error| ("journal", Fault::from(error))),
            _ => Ok(()),
        }
    }

    /// Makes safe what components have started in `init`, and closes and drops all that was made; returns why the robot does not start.
    fn abandon(self, path: &'static str, fault: Fault) -> StartError {
        self.control.begin_stop(&Caller::PROGRAM);
        self.control.wait_until_disarmed();
        self.control.drop_hooks();
        let made = (self.wired, self.sources, self.unwired.take_wiring(), self.kept);
        self.control.run_on_pool(Lane::User, move || discard(made));
        if let Some(journal) = self.environment.journal() {
            journal.close();
        }
        self.control.pool().close();
        // What hangs is left running. There is no report; the error says why the robot does not start.
        let _ = self.control.pool().left(Lane::User, Instant::now() + STOP_WITHIN);
        StartError::component(path, fault)
    }

    fn complete(self, wired: Arc<Wired>, keeper: Option<Keeper>) -> (Arc<Machine>, OpenSources) {
        let machine = Arc::new(Machine {
            robot: self.robot,
            wired,
            environment: self.environment,
            control: self.control,
            bus: Bus::new(Arc::clone(&self.host), Caller::PROGRAM),
            host: self.host,
            sources: Mutex::new(self.sources.iter().map(|source| source.shared()).collect()),
            has_ended: AtomicBool::new(false),
            last_report: OnceLock::new(),
            keeper: Mutex::new(keeper),
        });
        // It is set once.
        let _ = self.machine.set(Arc::downgrade(&machine));
        (machine, self.sources)
    }
}
