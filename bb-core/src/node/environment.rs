//! State shared by the estimators, sensors and services of one run.

mod comparison;

pub(crate) use self::comparison::{Comparison, Missing};
use super::entry::Report;
use super::shared::SharedNode;
use crate::component::replacement::{Replacement, Replacements};
use crate::component::{Binding, Guardian, Options, Template};
use crate::declaration::{EstimatorDeclaration, ParameterValues};
use crate::fault::{Failed, Fault, Place, lock};
use crate::joints::Joints;
use crate::journal::{Journal, Waiting};
use crate::lifecycle::Supervision;
use crate::message::{Frame, Origin, Payload, Stamp, Stamped};
use crate::pubsub::{AnyTopic as _, Topic};
use crate::schedule::{Agenda, Door, Lane, Pool, start_thread};
use crate::telemetry::Telemetry;
use crate::time::{Clock, MonotonicTime};
use bb_message::__private::Stopwatch;
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError};
use std::time::Instant;

/// The robot as its estimators see it: the control state records their reports without blocking.
pub(crate) trait Overseer: Guardian {
    fn report(&self, estimator: usize, report: Report);
    /// Registers that the options of the component at `path` are bound to these parameters. An estimator receives new values as
    /// entries; other components receive them through their inbox.
    fn bind(&self, path: &'static str, parameters: &'static [usize], check: Check, target: BindTarget);
    fn parameters(&self) -> ParameterValues;
    /// Runs `make`, which creates the component at `path` or changes its options. The disarm callbacks registered by `make` replace
    /// earlier ones.
    fn replacing_hooks(
        &self,
        path: &'static str,
        is_made: bool,
        make: &mut dyn FnMut() -> Result<(), Failed>,
    ) -> Result<(), Failed>;
    /// Logs that the component at `path` was left out, and forgets its disarm callbacks.
    fn leave_out(&self, path: &'static str, reason: &str);
}

/// Checks whether options would be valid with these parameters.
pub(crate) type Check = Box<dyn Fn(&ParameterValues) -> Result<(), String> + Send + Sync>;

/// The receiver of new values.
pub(crate) enum BindTarget {
    /// The estimator with that number.
    Estimator(usize),
    /// A component with its own inbox.
    Other(Box<dyn Fn() + Send + Sync>),
    /// No receiver: a command takes its options when it starts.
    Nobody,
}

/// Drains the island with that number.
type Drain = Box<dyn Fn(usize) + Send + Sync>;

/// Mode of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Real time, on many threads.
    Real,
    /// Virtual time, on the caller's thread.
    Virtual,
    /// A replay of a journal.
    Replay,
}

/// The first component that could not start.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub(crate) path: &'static str,
    pub(crate) fault: Fault,
}

/// State shared by the estimators, sensors and services of one run. Clones share the same state.
#[derive(Clone)]
pub struct Environment(Arc<Inner>);

/// State that each message reads. All else is behind a trait object: rustc proves for each robot that its wiring may be sent to
/// other threads, and would walk every type in here.
struct Inner {
    mode: Mode,
    clock: Clock,
    origin: Origin,
    door: Door,
    has_journal: bool,
    has_telemetry: bool,
    /// The line of the journal that is being replayed.
    replayed_line: AtomicU64,
    shared: Box<dyn Opaque>,
}

/// [`Shared`], whose types rustc does not look into where it is used.
trait Opaque: Send + Sync {
    fn shared(&self) -> &Shared;
}

impl Opaque for Shared {
    fn shared(&self) -> &Shared {
        self
    }
}

struct Shared {
    parts: EnvironmentParts,
    nodes: Box<[SharedNode]>,
    /// Drains an island, once the robot is wired.
    drain: OnceLock<Drain>,
    /// Islands with waiting entries, on virtual time.
    posted: Mutex<VecDeque<usize>>,
    refusal: Mutex<Option<Refusal>>,
    /// Facts about the components for the header of the journal.
    facts: Mutex<Vec<String>>,
    /// Facts about the declaration.
    declared_facts: Mutex<Vec<String>>,
    replayed: Comparison,
    /// Islands whose estimators have stopped.
    retired: (Mutex<usize>, Condvar),
}

/// The arguments of [`Environment::new`].
pub(crate) struct EnvironmentParts {
    pub(crate) mode: Mode,
    pub(crate) clock: Clock,
    pub(crate) origin: Origin,
    pub(crate) overseer: Arc<dyn Overseer>,
    pub(crate) supervision: Supervision,
    pub(crate) agenda: Agenda,
    pub(crate) pool: Pool,
    pub(crate) journal: Option<Journal>,
    pub(crate) telemetry: Option<Telemetry>,
    pub(crate) joints: Joints,
    pub(crate) replacements: Replacements,
    /// The time that all components see in their first `init`.
    pub(crate) start: MonotonicTime,
}

impl Environment {
    pub(crate) fn new(parts: EnvironmentParts, nodes: Box<[SharedNode]>) -> Self {
        if parts.mode == Mode::Real {
            // Without the thread, the clock is read.
            let _ = start_thread("bb-counter", Box::new(Stopwatch::prepare));
        }
        let has_journal = parts.journal.is_some();
        Self(Arc::new(Inner {
            mode: parts.mode,
            clock: parts.clock.clone(),
            origin: parts.origin,
            door: Door::new(has_journal),
            has_journal,
            has_telemetry: parts.telemetry.is_some(),
            replayed_line: AtomicU64::new(0),
            shared: Box::new(Shared {
                parts,
                nodes,
                drain: OnceLock::new(),
                posted: Mutex::default(),
                refusal: Mutex::default(),
                facts: Mutex::default(),
                declared_facts: Mutex::default(),
                replayed: Comparison::default(),
                retired: Default::default(),
            }),
        }))
    }

    fn shared(&self) -> &Shared {
        self.0.shared.shared()
    }

    /// Makes a component of a robot that starts, unless another component has failed to start. A failure is stored. The error says
    /// why the component does not run and whether it was left out.
    pub(crate) fn make<C>(
        &self,
        path: &'static str,
        make: impl FnOnce() -> Result<C, Fault>,
    ) -> Result<C, Option<String>> {
        if lock(&self.shared().refusal).is_some() {
            return Err(None);
        }
        // No lock is held: this is user code, and so is the logger.
        make().map_err(|fault| {
            let reason = fault.to_string();
            if fault.then == crate::fault::Then::Skip {
                self.overseer().leave_out(path, &reason);
                return Some(reason);
            }
            self.refuse(path, fault);
            None
        })
    }

    /// Stores why the robot cannot start, unless another component has already done so.
    pub(crate) fn refuse(&self, path: &'static str, fault: Fault) {
        lock(&self.shared().refusal).get_or_insert(Refusal { path, fault });
    }

    /// The reason why the robot could not start, if any.
    pub(crate) fn take_refusal(&self) -> Option<Refusal> {
        lock(&self.shared().refusal).take()
    }

    /// Notifies `target` of changes to the parameters bound to these options. A value that would make the options invalid is
    /// refused.
    pub(crate) fn bind<O: Options>(
        &self,
        path: &'static str,
        options: &O,
        binding: Binding<O>,
        target: BindTarget,
    ) {
        // The options of a component that is replaced are not used.
        if !binding.parameters.is_empty() && self.replacement(path).is_none() {
            let template = match Template::new(options) {
                Ok(template) => template,
                Err(fault) => return self.refuse(path, fault),
            };
            let check = move |values: &ParameterValues| template.bound(&binding, values).map(drop);
            self.shared().parts.overseer.bind(path, binding.parameters, Box::new(check), target);
        }
    }

    /// Adds a fact to the header of the journal.
    pub(crate) fn add_fact(&self, fact: String) {
        lock(&self.shared().facts).push(fact);
    }

    pub(crate) fn add_declared_fact(&self, fact: String) {
        lock(&self.shared().declared_facts).push(fact);
    }

    /// Facts of the components.
    pub(crate) fn facts(&self) -> Vec<String> {
        lock(&self.shared().facts).clone()
    }

    /// All facts, for the header of a journal.
    pub(crate) fn all_facts(&self) -> Vec<String> {
        lock(&self.shared().declared_facts).iter().chain(&*lock(&self.shared().facts)).cloned().collect()
    }

    /// Sets the function that drains an island, once the robot is wired.
    pub(crate) fn set_drain(&self, drain: impl Fn(usize) + Send + Sync + 'static) {
        // This is set only once.
        let _ = self.shared().drain.set(Box::new(drain));
    }

    /// Schedules an island with a new entry to be drained by the pool or by the loop of a simulation.
    pub(crate) fn schedule_drain(&self, island: usize) {
        match self.0.mode {
            Mode::Real => {
                let environment = self.clone();
                self.shared().parts.pool.submit(Lane::Robot, move || environment.drain(island));
            }
            Mode::Virtual => lock(&self.shared().posted).push_back(island),
            Mode::Replay => {}
        }
    }

    pub(crate) fn drain(&self, island: usize) {
        if let Some(drain) = self.shared().drain.get() {
            drain(island);
        }
    }

    /// Drains the islands with waiting entries, on virtual time.
    pub(crate) fn drain_posted(&self) {
        loop {
            let island = lock(&self.shared().posted).pop_front();
            match island {
                Some(island) => self.drain(island),
                None => return,
            }
        }
    }

    /// Records that the estimators of one more island have stopped.
    pub(super) fn note_retired(&self) {
        *lock(&self.shared().retired.0) += 1;
        self.shared().retired.1.notify_all();
    }

    /// Waits until the estimators of this many islands have stopped, or until `deadline`.
    pub(crate) fn wait_for_retired(&self, islands: usize, deadline: Instant) {
        let mut retired = lock(&self.shared().retired.0);
        while *retired < islands {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            retired = self.shared().retired.1.wait_timeout(retired, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    pub(crate) fn node(&self, number: usize) -> SharedNode {
        match self.shared().nodes.get(number) {
            Some(node) => node.clone(),
            // Numbers and declarations come from the same expansion.
            None => SharedNode::new(usize::MAX, &EstimatorDeclaration::NONE),
        }
    }

    pub(crate) fn nodes(&self) -> &[SharedNode] {
        &self.shared().nodes
    }

    pub(crate) fn mode(&self) -> Mode {
        self.0.mode
    }

    pub(crate) fn clock(&self) -> &Clock {
        &self.0.clock
    }

    pub(crate) fn origin(&self) -> Origin {
        self.0.origin
    }

    pub(crate) fn overseer(&self) -> &Arc<dyn Overseer> {
        &self.shared().parts.overseer
    }

    pub(crate) fn supervision(&self) -> Supervision {
        self.shared().parts.supervision
    }

    pub(crate) fn agenda(&self) -> &Agenda {
        &self.shared().parts.agenda
    }

    pub(crate) fn pool(&self) -> &Pool {
        &self.shared().parts.pool
    }

    /// The states of the joints.
    #[inline]
    pub(crate) fn joints(&self) -> &Joints {
        &self.shared().parts.joints
    }

    /// The replacement of the component at `path`, if there is one.
    pub(crate) fn replacement(&self, path: &str) -> Option<&Replacement> {
        self.shared().parts.replacements.get(path)
    }

    /// The entry point for messages.
    #[inline]
    pub(crate) fn door(&self) -> &Door {
        &self.0.door
    }

    pub(crate) fn start(&self) -> MonotonicTime {
        self.shared().parts.start
    }

    /// The place that a thread is inside of while it holds an island of the robot.
    #[inline]
    pub(super) fn place(&self) -> Place {
        Place::Island(Arc::as_ptr(&self.0).addr())
    }

    #[inline]
    pub(crate) fn journal(&self) -> Option<&Journal> {
        if self.0.has_journal { self.shared().parts.journal.as_ref() } else { None }
    }

    #[inline]
    pub(crate) fn telemetry(&self) -> Option<&Telemetry> {
        if self.0.has_telemetry { self.shared().parts.telemetry.as_ref() } else { None }
    }

    /// Returns whether individual messages are observed by a journal, a telemetry handler or the comparison of a replay.
    #[inline]
    pub(crate) fn is_observed(&self) -> bool {
        self.0.has_journal || self.0.has_telemetry || self.0.mode == Mode::Replay
    }

    pub(crate) fn replayed(&self) -> &Comparison {
        &self.shared().replayed
    }

    pub(crate) fn set_replayed_line(&self, line: u64) {
        self.0.replayed_line.store(line, Ordering::Relaxed);
    }

    /// The stamp of a message that the robot publishes, measured at that time.
    #[inline]
    pub(crate) fn stamp(&self, monotonic_time: MonotonicTime, frame: Frame) -> Stamp {
        Stamp { monotonic_time, wall_time: self.0.clock.wall_at(monotonic_time), frame, origin: self.0.origin }
    }

    /// Passes a message of a sensor or a service to its subscribers and writes it to the journal, if there is one. Returns the line
    /// number, or 0. A panic of the payload's `Clone` is left to the publisher's turn.
    #[inline]
    pub fn publish<T: Payload>(
        &self,
        publisher: usize,
        topic: &Topic<T>,
        message: &Stamped<T>,
        now: MonotonicTime,
    ) -> u64 {
        if T::TELLS_JOINT_POSITION {
            self.shared().parts.joints.hear(message, now);
        }
        match self.journal() {
            None => {
                topic.publish(message);
                self.0.replayed_line.load(Ordering::Relaxed)
            }
            Some(journal) => {
                journal.wait_for_room();
                let mut waiting = Some(Waiting::new(topic.path(), message.clone()));
                let offset = self.0.clock.wall_offset_nanos();
                topic.publish_as_written(message, || journal.write_message(now, offset, publisher, &mut waiting))
            }
        }
    }

    /// Counts a message that did not fit in the inbox of the estimator's island.
    pub fn overflow(&self, estimator: usize, input: usize) {
        if let Some(node) = self.shared().nodes.get(estimator) {
            node.overflow(input);
        }
    }
}

impl fmt::Debug for Environment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Environment").field("robot", &self.0.origin.robot).finish_non_exhaustive()
    }
}
