//! One running estimator: what comes in, what goes out, and what becomes of it when it fails.

mod recovery;
mod requests;

use self::recovery::Restart;
use self::requests::Cast;
use super::admission::Admission;
use super::health::{Event, Health};
use super::shared::SharedNode;
use super::timers::Timers;
use super::{DropReason, EstimatorDeclaration, HealthReason, HealthState, HealthTransition, InputDeclaration};
use crate::component::{Context, Estimator, Fault, InputAt, Inputs, Reply, Request, SyncMiss};
use crate::control::Binding;
use crate::message::{Stamp, Stamped};
use crate::run::{Failed, Startup, caught, retire};
use crate::time::{Clock, MonotonicTime};
use std::fmt;

/// One estimator with its fan-in, its health and its timers. Its island's lock sees to it that one thread at a time is in
/// here.
pub struct Node<E: Estimator> {
    declaration: &'static EstimatorDeclaration,
    template: Stamp,
    clock: Clock,
    shared: SharedNode,
    startup: Startup,
    /// None while it does not run.
    estimator: Option<E>,
    cache: <E::Input as Inputs>::Cache,
    admission: Admission,
    health: Health,
    /// When the last input was let in.
    last_input: MonotonicTime,
    timers: Timers,
    /// When its island is woken for it, or before.
    scheduled: Option<MonotonicTime>,
    /// How often in a row it has gone on with its work.
    continued: u32,
    /// What it asked for in `init`, until the run begins.
    requested: Vec<Request>,
    has_begun: bool,
    restart: Restart,
    recipe: Recipe<E>,
}

/// How often in a row it may go on with its work before it is taken to be stuck.
const STUCK_AFTER: u32 = 1_000_000;

/// What it is made of, at the start and at every restart.
struct Recipe<E: Estimator> {
    options: E::Options,
    binding: Binding<E::Options>,
    cache: fn() -> <E::Input as Inputs>::Cache,
}

/// What became of a message.
enum Handled<O> {
    Refused(DropReason),
    Stored,
    Missed(SyncMiss),
    Ran(Reply<O>),
}

/// What [`Node::turn`] has done.
#[derive(Debug)]
pub enum Turn {
    /// Nothing is due.
    Idle,
    /// Something was, and emitted nothing.
    Quiet,
    /// Something was, and emitted.
    Emitted(Stamp),
}

impl<E: Estimator> Node<E> {
    /// Makes the estimator; what keeps it from starting is in `startup`. `cache` makes the slots of its inputs, and
    /// `binding` puts parameters into its options.
    pub fn new(
        number: usize,
        options: &E::Options,
        binding: Binding<E::Options>,
        cache: fn() -> <E::Input as Inputs>::Cache,
        startup: &Startup,
    ) -> Self {
        let shared = startup.node(number);
        let declaration = shared.declaration();
        let now = startup.clock().now();
        let context = Context::new(startup.robot(), declaration, now);
        let made = startup.make(declaration.path, options, binding, |options| E::init(options, &context));
        startup.bind_node(&shared, options, binding);
        if let Err(reason) = &made {
            shared.set_stopped(Some(reason.clone()));
        }
        Self {
            declaration,
            template: Stamp { frame: declaration.frame, origin: startup.origin(), ..Stamp::default() },
            clock: startup.clock().clone(),
            shared,
            startup: startup.clone(),
            estimator: made.ok(),
            cache: cache(),
            admission: Admission::new(declaration.inputs.len()),
            health: Health::default(),
            last_input: now,
            timers: Timers::default(),
            scheduled: None,
            continued: 0,
            requested: context.into_requests(),
            has_begun: false,
            restart: Restart::default(),
            recipe: Recipe { options: options.clone(), binding, cache },
        }
    }

    /// Takes a message of the declared input number `input`, which is the algorithm's field `I`, that arrived at `now`. If
    /// it is the driver and all is well, the estimator runs; the stamp of what it put into `emitted`, if anything.
    #[inline]
    pub fn receive<const I: usize>(
        &mut self,
        input: usize,
        message: &Stamped<<E::Input as InputAt<I>>::Payload>,
        now: MonotonicTime,
        emitted: &mut Option<E::Output>,
    ) -> Option<Stamp>
    where
        E::Input: InputAt<I>,
    {
        let declared = self.declaration.inputs.get(input)?;
        let counters = self.shared.counters();
        counters.inputs[input].received.increment();
        let Some(running) = &mut self.estimator else {
            counters.drop(input, DropReason::Stopped);
            return None;
        };
        let (admission, cache, clock) = (&mut self.admission, &mut self.cache, &self.clock);
        let budget = self.declaration.health.latency_budget_nanos;
        let mut start = MonotonicTime::ZERO;
        // All of the user's code at once: the payload's, the cache's clone and the estimator. After a panic the
        // estimator is dropped, so that nothing sees what was left half done.
        let handled = caught(|| {
            if let Err(reason) = admission.admit(input, message, now) {
                return Ok(Handled::Refused(reason));
            }
            if !declared.driver {
                if let Some(slot) = <E::Input as InputAt<I>>::slot(cache) {
                    slot.store(message);
                }
                return Ok(Handled::Stored);
            }
            let view = match <E::Input as InputAt<I>>::snapshot(cache, message) {
                Ok(view) => view,
                Err(miss) => return Ok(Handled::Missed(miss)),
            };
            counters.dispatched.increment();
            if budget.is_some() {
                start = clock.now();
            }
            running.handle_input(view).map(Handled::Ran)
        });
        match handled {
            Ok(Handled::Ran(reply)) => {
                self.arrived(declared, now);
                let mut bad = match budget {
                    Some(budget) => {
                        let (bad, end) = self.overrun(budget, start);
                        if let Some(age) = &self.shared.counters().inputs[input].age {
                            age.add(end.nanos_since(message.monotonic_time).max(0) as u64);
                        }
                        bad
                    }
                    None => None,
                };
                if let Some(limit) = declared.stale_after_nanos
                    && now.nanos_since(message.monotonic_time) > limit
                {
                    bad = bad.or(Some(HealthReason::StaleInput));
                }
                let stamp =
                    Stamp { monotonic_time: message.monotonic_time, wall_time: message.wall_time, ..self.template };
                self.complete(reply, bad, declared.source, stamp, now, emitted)
            }
            Ok(Handled::Stored) => {
                self.arrived(declared, now);
                None
            }
            Ok(Handled::Refused(reason)) => {
                self.refuse(declared, reason, message.monotonic_time.as_nanos());
                None
            }
            Ok(Handled::Missed(miss)) => {
                self.arrived(declared, now);
                self.miss(miss, now);
                None
            }
            Err(failed) => {
                self.fail(failed, now);
                None
            }
        }
    }

    /// Whether it has asked to go on at once.
    #[inline]
    pub fn is_unfinished(&self) -> bool {
        self.timers.continue_with.is_some()
    }

    /// Does one thing that is due, if any is.
    pub fn turn(&mut self, now: MonotonicTime, emitted: &mut Option<E::Output>) -> Turn {
        self.begin(now);
        if self.shared.take_restart() {
            self.leave_for_restart(now);
        }
        if self.estimator.is_none() {
            if self.restart.at.is_some_and(|at| at <= now) {
                self.make_anew(now);
                return Turn::Quiet;
            }
            self.schedule();
            return Turn::Idle;
        }
        if let Some(step) = self.timers.continue_with.take() {
            return self.go_on(step, now, emitted);
        }
        self.continued = 0;
        if self.shared.take_changed_options() {
            self.change_options(now);
            return Turn::Quiet;
        }
        if let Some(cast) = self.shared.take_cast() {
            return match cast.downcast::<Cast<E>>() {
                Ok(cast) => self.run(now, emitted, *cast),
                Err(_) => Turn::Quiet,
            };
        }
        if self.lost_at().is_some_and(|at| at <= now) {
            let source = self.declaration.inputs.iter().find(|input| input.driver);
            self.judge(Event::Silence, source.map_or("", |input| input.source), now);
            return Turn::Quiet;
        }
        if let Some(info) = self.timers.take(now) {
            return self.run(now, emitted, |estimator| estimator.handle_info(info));
        }
        self.schedule();
        Turn::Idle
    }

    /// Lets the estimator clean up and drops it; messages that still come are counted as dropped.
    pub fn terminate(&mut self) {
        self.restart.at = None;
        self.shared.refuse_casts();
        if let Some(fault) = self.estimator.take().and_then(|estimator| retire(estimator, false, E::terminate)) {
            self.startup.fault(self.declaration.path, &fault);
            self.shared.set_stopped(Some(fault.to_string()));
        }
    }

    fn go_on(&mut self, step: u32, now: MonotonicTime, emitted: &mut Option<E::Output>) -> Turn {
        self.continued += 1;
        if self.continued <= STUCK_AFTER {
            return self.run(now, emitted, |estimator| estimator.handle_continue(step));
        }
        self.continued = 0;
        let message =
            format!("it asked {STUCK_AFTER} times in a row to go on at {now}, and nothing else could happen");
        self.fail(Failed { fault: Fault::permanent(message), panicked: false }, now);
        Turn::Quiet
    }

    /// Any callback but `handle_input`.
    fn run(
        &mut self,
        now: MonotonicTime,
        emitted: &mut Option<E::Output>,
        callback: impl FnOnce(&mut E) -> Result<Reply<E::Output>, Fault>,
    ) -> Turn {
        let Some(running) = &mut self.estimator else { return Turn::Quiet };
        let start = self.clock.now();
        match caught(|| callback(running)) {
            Ok(reply) => {
                let bad = self.declaration.health.latency_budget_nanos;
                let bad = bad.and_then(|budget| self.overrun(budget, start).0);
                let stamp = Stamp { monotonic_time: now, wall_time: self.clock.wall_at(now), ..self.template };
                let path = self.declaration.path;
                self.complete(reply, bad, path, stamp, now, emitted).map_or(Turn::Quiet, Turn::Emitted)
            }
            Err(failed) => {
                self.fail(failed, now);
                Turn::Quiet
            }
        }
    }

    #[inline]
    fn complete(
        &mut self,
        reply: Reply<E::Output>,
        bad: Option<HealthReason>,
        source: &'static str,
        stamp: Stamp,
        now: MonotonicTime,
        emitted: &mut Option<E::Output>,
    ) -> Option<Stamp> {
        let Reply { output, diverged, request } = reply;
        self.timers.happened();
        if let Some(request) = request {
            self.timers.request(request, now);
            self.schedule();
        }
        if bad.is_some() || diverged.is_some() || self.health.state != HealthState::Healthy {
            self.assess(bad, diverged, source, now);
        }
        *emitted = output;
        emitted.is_some().then(|| {
            self.shared.counters().emitted.increment();
            stamp
        })
    }

    #[cold]
    fn assess(
        &mut self,
        bad: Option<HealthReason>,
        diverged: Option<&'static str>,
        source: &'static str,
        now: MonotonicTime,
    ) {
        if let Some(reason) = diverged {
            self.shared.counters().diverge(reason);
            tracing::debug!(estimator = self.declaration.path, reason, "diverged");
        }
        let bad = bad.or(diverged.map(|_| HealthReason::Diverged));
        self.judge(bad.map_or(Event::Good, Event::Bad), source, now);
    }

    /// Measures a callback that has a budget; the reason if it took longer, and when it was over.
    fn overrun(&self, budget_nanos: i64, start: MonotonicTime) -> (Option<HealthReason>, MonotonicTime) {
        let mut end = self.clock.now();
        if self.clock.is_virtual() {
            end = end.plus_nanos(self.shared.pretended_latency_nanos());
        }
        let elapsed = end.nanos_since(start);
        self.shared.counters().latency.add(elapsed.max(0) as u64);
        if elapsed <= budget_nanos {
            return (None, end);
        }
        if let Some(journal) = self.startup.journal() {
            journal.overrun(start, self.shared.number());
        }
        (Some(HealthReason::LatencyOverrun), end)
    }

    /// An input was let in.
    #[inline]
    fn arrived(&mut self, input: &InputDeclaration, now: MonotonicTime) {
        self.last_input = now;
        if self.health.state == HealthState::Lost {
            self.judge(Event::Input, input.source, now);
            self.schedule();
        }
    }

    #[cold]
    fn judge(&mut self, event: Event, source: &'static str, time: MonotonicTime) {
        let from = self.health.state;
        let Some((to, reason)) = self.health.on(event, self.declaration.health.recover_after) else { return };
        self.shared.set_health(to);
        self.shared.counters().transitions.increment();
        let transition = HealthTransition { estimator: self.declaration.path, source, from, to, reason, time };
        self.startup.health_changed(transition, self.declaration.health.command(from, to));
    }

    #[cold]
    fn refuse(&self, input: &InputDeclaration, reason: DropReason, time_nanos: i64) {
        self.shared.counters().drop(input.index, reason);
        let (estimator, input, reason) = (self.declaration.path, input.name, reason.name());
        tracing::debug!(estimator, input, reason, time_nanos, "message dropped");
    }

    #[cold]
    fn miss(&mut self, miss: SyncMiss, now: MonotonicTime) {
        self.shared.counters().drop(miss.input, DropReason::SyncMiss);
        let Some(input) = self.declaration.inputs.get(miss.input) else { return };
        let (age_nanos, tolerance_nanos) = (miss.age_nanos, input.tolerance_nanos);
        let estimator = self.declaration.path;
        tracing::debug!(estimator, input = input.name, age_nanos, tolerance_nanos, "dispatch dropped for sync");
        self.judge(Event::Bad(HealthReason::SyncMiss), input.source, now);
    }

    /// The first turn: time may have been set to a recording's after it was made.
    fn begin(&mut self, now: MonotonicTime) {
        if !self.has_begun {
            self.has_begun = true;
            self.last_input = now;
            for request in std::mem::take(&mut self.requested) {
                self.timers.request(request, now);
            }
        }
        // Whoever is woken says anew when to be woken next.
        self.scheduled = None;
    }

    fn lost_at(&self) -> Option<MonotonicTime> {
        let after = self.declaration.health.lost_after_nanos?;
        (self.health.state != HealthState::Lost).then(|| self.last_input.plus_nanos(after))
    }

    /// Has the island woken when something is due next.
    fn schedule(&mut self) {
        let next = match &self.estimator {
            Some(_) => self.timers.next().into_iter().chain(self.lost_at()).min(),
            None => self.restart.at,
        };
        if let Some(next) = next
            && self.scheduled.is_none_or(|scheduled| next < scheduled)
        {
            self.scheduled = Some(next);
            self.startup.agenda().wake_at(next, self.declaration.island);
        }
    }
}

impl<E: Estimator> Drop for Node<E> {
    /// Of a robot that did not start.
    fn drop(&mut self) {
        if let Some(estimator) = self.estimator.take() {
            let _ = retire(estimator, false, E::terminate);
        }
    }
}

impl<E: Estimator> fmt::Debug for Node<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Node").field("path", &self.declaration.path).finish_non_exhaustive()
    }
}
