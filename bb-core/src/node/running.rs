//! One running estimator: its inputs, its outputs and its failures.

mod judging;
mod placing;
mod recovery;
mod requests;

use super::DropReason;
use super::admission::Admission;
use super::backlog::Backlog;
use super::counters::SAMPLED;
use super::emission::{copied_of, copy_failed};
use super::environment::{BindTarget, Environment, Mode};
use super::health::Health;
use super::shared::{SharedNode, Stopped};
use super::timers::Timers;
use super::turn::Turn;
use crate::component::inputs;
use crate::component::{Binding, Context, Estimator, Guardian, Inputs, Reply, Request, SyncMiss, TakenAt};
use crate::declaration::{EstimatorDeclaration, ParameterValues};
use crate::event::HealthReason;
use crate::fault::{Failed, Fault, caught, discard};
use crate::lifecycle::{AsEstimator, Recipe, Slot};
use crate::message::{Stamp, Stamped};
use crate::time::MonotonicTime;
use placing::{Placing, Unplaced};
use std::fmt;
use std::sync::Arc;

/// One estimator with its fan-in, its health and its timers. Its island lets one thread at a time run it.
pub struct Node<E: Estimator> {
    declaration: &'static EstimatorDeclaration,
    template: Stamp,
    shared: SharedNode,
    environment: Environment,
    slot: Slot<AsEstimator<E>>,
    cache: <E::Input as Inputs>::Cache,
    make_cache: fn() -> <E::Input as Inputs>::Cache,
    admission: Admission,
    backlog: Backlog<Deliver<E>>,
    /// The transforms of its inputs, if some of them span moving joints.
    placing: Placing,
    health: Health,
    /// How many losses the estimator knows of.
    epoch: u32,
    /// Whether its last run was good.
    was_good: bool,
    timers: Timers,
    /// The latest time at which its island is woken for it.
    scheduled: Option<MonotonicTime>,
    /// How many times in a row it has continued its work.
    continued: u32,
    /// The requests made in its first `init`, kept until it starts.
    requested: Vec<Request>,
    /// The parameter values that it received last.
    parameters: ParameterValues,
}

/// Delivers a stored message to its estimator; returns the stamp of the emitted output, if any.
type Deliver<E> =
    Box<dyn FnOnce(&mut Node<E>, &Turn<'_>, &mut Option<<E as Estimator>::Output>) -> Option<Stamp> + Send>;

/// How many times in a row an estimator may continue its work before it is considered stuck.
const STUCK_AFTER: u32 = 1_000_000;

/// The outcome of handling a message.
enum Handled {
    Refused(DropReason),
    Stored,
    Missed(SyncMiss),
    Unplaced(Unplaced),
    Ran,
}

/// The destinations of the parts of a reply, which are moved one by one. Moving a whole reply from one result into the next costs
/// more than the rest of a hop.
struct Taken<'a, O> {
    emitted: &'a mut Option<O>,
    timers: &'a mut Timers,
    diverged: Option<&'static str>,
    /// Whether a new request was made.
    has_asked: bool,
}

impl<'a, O> Taken<'a, O> {
    #[inline]
    fn new(emitted: &'a mut Option<O>, timers: &'a mut Timers) -> Self {
        Self { emitted, timers, diverged: None, has_asked: false }
    }

    #[inline]
    fn take(&mut self, reply: Reply<O>, now: MonotonicTime) {
        let Reply { output, diverged, request } = reply;
        *self.emitted = output;
        self.diverged = diverged;
        self.timers.happened();
        if let Some(request) = request {
            self.timers.request(request, now);
            self.has_asked = true;
        }
    }
}

/// The result of [`Node::turn`].
#[derive(Debug)]
pub enum Next {
    /// Nothing was due.
    Idle,
    /// Something was due, but nothing was emitted.
    Quiet,
    /// Something was due, and an output was emitted.
    Emitted(Stamp),
}

impl<E: Estimator> Node<E> {
    /// Creates the estimator; an error that prevents it from starting is stored in `environment`. `make_cache` creates the slots of
    /// its inputs, and `binding` puts parameters into its options. In a replay the estimator is created when the journal begins.
    pub fn new(
        number: usize,
        options: &E::Options,
        binding: Binding<E::Options>,
        make_cache: fn() -> <E::Input as Inputs>::Cache,
        environment: &Environment,
    ) -> Self {
        let shared = environment.node(number);
        let declaration = shared.declaration();
        let placing = Placing::new(number, declaration, environment);
        let replacement = environment.replacement(declaration.path);
        if let Some(fault) = replacement.and_then(|replacement| placing.fault_of(replacement)) {
            environment.refuse(declaration.path, fault);
        }
        let fact = || match replacement {
            Some(replacement) => format!("replacement of {}: {}", declaration.path, replacement.shown()),
            None => format!("options of {}: {options:?}", declaration.path),
        };
        match caught(|| Ok(fact())) {
            Ok(fact) => environment.add_fact(fact),
            Err(failed) => environment.refuse(declaration.path, failed.fault),
        }
        environment.bind(declaration.path, options, binding, BindTarget::Estimator(number));
        let mut node = Self {
            declaration,
            template: Stamp { frame: declaration.frame, origin: environment.origin(), ..Stamp::default() },
            shared,
            environment: environment.clone(),
            slot: Slot::new(Recipe::new(options, binding), environment.supervision()),
            cache: make_cache(),
            make_cache,
            admission: Admission::new(declaration.inputs.len()),
            backlog: Backlog::new(),
            placing,
            health: Health::default(),
            epoch: 0,
            was_good: false,
            timers: Timers::default(),
            scheduled: None,
            continued: 0,
            requested: Vec::new(),
            parameters: environment.overseer().parameters(),
        };
        if environment.mode() != Mode::Replay {
            node.make_first(environment.start());
        }
        node
    }

    /// Takes a message for the declared input number `input`, which is the algorithm's field `F`. If it is the driver and no
    /// required input is missing, the estimator runs. Returns the stamp of the output put into `emitted`, if any.
    #[inline]
    pub fn receive<F: TakenAt<E::Input>>(
        &mut self,
        input: usize,
        message: &Stamped<F::Payload>,
        turn: &Turn<'_>,
        emitted: &mut Option<E::Output>,
    ) -> Option<Stamp> {
        self.shared.counters().inputs.get(input)?.received.increment();
        if turn.is_observed() {
            self.tell_input(input, message.stamp(), turn);
        }
        if self.slot.is_running() && self.backlog.is_empty() {
            return self.take_in::<F>(input, message, turn, emitted);
        }
        self.keep::<F>(input, message);
        None
    }

    /// As above, for a message that has already been counted.
    #[inline]
    pub(super) fn take_in<F: TakenAt<E::Input>>(
        &mut self,
        input: usize,
        message: &Stamped<F::Payload>,
        turn: &Turn<'_>,
        emitted: &mut Option<E::Output>,
    ) -> Option<Stamp> {
        let declared = self.declaration.inputs.get(input)?;
        let running = self.slot.running()?;
        let handles_moving_joints = running.handles_moving_joints();
        let (admission, cache) = (&mut self.admission, &mut self.cache);
        let placing = &mut self.placing;
        let mut taken = Taken::new(emitted, &mut self.timers);
        let counters = self.shared.counters();
        let budget = self.declaration.health.latency_budget_nanos;
        let mut begun = None;
        turn.enter(self.shared.number() as u32);
        // All user code runs in one call: the payload's code, the cache's clone and the estimator. After a panic the estimator is
        // dropped, so nothing sees a half-finished state.
        let handled = caught(|| {
            if let Err(reason) = admission.admit(input, message, turn.now()) {
                return Ok(Handled::Refused(reason));
            }
            if !declared.driver {
                if let Some(slot) = F::slot(cache) {
                    let stored = inputs::Slot::store(slot, message);
                    if stored.has_displaced {
                        counters.drop(input, DropReason::Displaced);
                    }
                    if let Some(panic) = stored.panic {
                        copy_failed(turn.environment(), declared.source, panic);
                    }
                }
                turn.timing().interrupt();
                return Ok(Handled::Stored);
            }
            if handles_moving_joints {
                turn.timing().interrupt();
            }
            if handles_moving_joints && let Err(unplaced) = placing.place(message.monotonic_time, admission, turn) {
                return Ok(Handled::Unplaced(unplaced));
            }
            let view = match F::snapshot(cache, message) {
                Ok(view) => view,
                Err(miss) => return Ok(Handled::Missed(miss)),
            };
            let dispatched = counters.dispatched.increment();
            if budget.is_some() || dispatched.is_multiple_of(SAMPLED) {
                begun = Some(turn.timing().begin(turn.environment()));
            } else {
                turn.timing().interrupt();
            }
            if handles_moving_joints {
                running.handle_transforms(&placing.transforms(message.monotonic_time))?;
            }
            running.handle_input(view, |reply| taken.take(reply, turn.now()))?;
            Ok(Handled::Ran)
        });
        let Taken { diverged, has_asked, .. } = taken;
        match handled {
            Ok(Handled::Ran) => {
                if self.declaration.health.lost_after_nanos.is_some() {
                    self.shared.set_last_run(turn.now());
                }
                let mut bad =
                    begun.and_then(|begun| self.measure(begun, Some((input, message.monotonic_time)), turn));
                if let Some(limit) = declared.stale_after_nanos
                    && turn.now().nanos_since(message.monotonic_time) > limit
                {
                    bad = bad.or(Some(HealthReason::StaleInput));
                }
                let Stamped { monotonic_time, wall_time, .. } = *message;
                let stamp = Stamp { monotonic_time, wall_time, ..self.template };
                let has_emitted = emitted.is_some();
                self.complete(diverged, has_asked, bad, Some(declared.source), has_emitted, turn);
                has_emitted.then_some(stamp)
            }
            Ok(Handled::Stored) => None,
            Ok(Handled::Refused(reason)) => {
                turn.timing().interrupt();
                self.refuse(declared, reason, message.monotonic_time.as_nanos());
                None
            }
            Ok(Handled::Missed(miss)) => {
                turn.timing().interrupt();
                self.miss(miss, turn);
                None
            }
            Ok(Handled::Unplaced(unplaced)) => {
                turn.timing().interrupt();
                self.note_unplaced(&unplaced, turn);
                None
            }
            Err(failed) => {
                self.fail(failed, turn);
                None
            }
        }
    }

    /// Whether the estimator has asked to continue at once.
    #[inline]
    pub fn is_unfinished(&self) -> bool {
        self.timers.continue_with.is_some()
    }

    /// Does one thing that is due, if any.
    pub fn turn(&mut self, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        turn.timing().interrupt();
        // An estimator that has been woken schedules its next wake-up.
        self.scheduled = None;
        if self.slot.restart_at().is_some_and(|at| at <= turn.now()) {
            self.restart(turn);
            return Next::Quiet;
        }
        if !self.slot.is_running() {
            self.schedule();
            return Next::Idle;
        }
        if let Some(step) = self.timers.continue_with.take() {
            return self.go_on(step, turn, emitted);
        }
        self.continued = 0;
        if let Some(deliver) = self.backlog.pop() {
            return deliver(self, turn, emitted).map_or(Next::Quiet, Next::Emitted);
        }
        if let Some(info) = self.timers.take(turn.now()) {
            return self.run(turn, emitted, |estimator| estimator.handle_info(info));
        }
        self.schedule();
        Next::Idle
    }

    fn go_on(&mut self, step: u32, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        self.continued += 1;
        if self.continued <= STUCK_AFTER {
            return self.run(turn, emitted, |estimator| estimator.handle_continue(step));
        }
        self.continued = 0;
        let now = turn.now();
        let message =
            format!("it asked {STUCK_AFTER} times in a row to go on at {now}, and nothing else could happen");
        self.fail(Failed::from(Fault::permanent(message)), turn);
        Next::Quiet
    }

    /// Runs any callback other than `handle_input`. It can degrade the estimator, but does not count towards its recovery.
    fn run(
        &mut self,
        turn: &Turn<'_>,
        emitted: &mut Option<E::Output>,
        callback: impl FnOnce(&mut AsEstimator<E>) -> Result<Reply<E::Output>, Fault>,
    ) -> Next {
        let Some(running) = self.slot.running() else { return Next::Quiet };
        turn.enter(self.shared.number() as u32);
        let is_measured = self.declaration.health.latency_budget_nanos.is_some();
        let begun = is_measured.then(|| turn.timing().begin(turn.environment()));
        let mut taken = Taken::new(emitted, &mut self.timers);
        let called = caught(|| {
            taken.take(callback(running)?, turn.now());
            Ok(())
        });
        let Taken { diverged, has_asked, .. } = taken;
        match called {
            Ok(()) => {
                let bad = begun.and_then(|begun| self.measure(begun, None, turn));
                let now = turn.now();
                let stamp = Stamp { monotonic_time: now, wall_time: turn.wall_at(now), ..self.template };
                self.complete(diverged, has_asked, bad, None, emitted.is_some(), turn);
                if emitted.is_some() { Next::Emitted(stamp) } else { Next::Quiet }
            }
            Err(failed) => {
                turn.no_emission();
                self.fail(failed, turn);
                Next::Quiet
            }
        }
    }

    /// Stores a message until after the restart, or counts it as dropped if no restart is planned.
    #[cold]
    fn keep<F: TakenAt<E::Input>>(&mut self, input: usize, message: &Stamped<F::Payload>) {
        let is_kept = self.slot.is_running() || self.slot.restart_at().is_some();
        if !is_kept {
            self.shared.counters().drop(input, DropReason::Stopped);
            return;
        }
        let declared = self.declaration.inputs.get(input);
        let copy = declared.and_then(|declared| copied_of(&self.environment, declared.source, message));
        let Some(message) = copy else {
            self.shared.counters().drop(input, DropReason::Stopped);
            return;
        };
        let deliver: Deliver<E> = Box::new(move |node, turn, emitted| {
            let next = node.take_in::<F>(input, &message, turn, emitted);
            discard(message);
            next
        });
        // Dropping the oldest message to make room runs user code.
        match caught(|| Ok(self.backlog.push(input, deliver))) {
            Ok(Some(oldest)) => self.shared.counters().drop(oldest, DropReason::Stopped),
            Ok(None) => {}
            Err(failed) => {
                self.shared.counters().drop(input, DropReason::Stopped);
                self.report_failure(&failed);
            }
        }
    }

    /// Schedules the next wake-up of the island.
    fn schedule(&mut self) {
        let next = if self.slot.is_running() { self.timers.next() } else { self.slot.restart_at() };
        if let Some(next) = next
            && self.scheduled.is_none_or(|scheduled| next < scheduled)
        {
            self.scheduled = Some(next);
            self.environment.agenda().wake_at(next, self.declaration.island);
        }
    }

    fn set_stopped(&self, reason: Option<(String, bool)>) {
        self.shared.set_stopped(reason.map(|(reason, for_good)| Stopped { reason, for_good }));
    }

    fn context(&self, now: MonotonicTime) -> Context {
        let guardian: Arc<dyn Guardian> = Arc::clone(self.environment.overseer()) as _;
        let replacement = self.environment.replacement(self.declaration.path).cloned();
        Context::new(self.environment.origin().robot, self.declaration, now, Some(guardian))
            .with_replacement(replacement)
    }
}

impl<E: Estimator> fmt::Debug for Node<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Node").field("path", &self.declaration.path).finish_non_exhaustive()
    }
}
