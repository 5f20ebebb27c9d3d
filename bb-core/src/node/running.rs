//! One running estimator: its inputs, its outputs and its failures.
//!
//! [`Node`] is what depends on the estimator's type, and calls it. [`Common`] is the rest. A turn of an estimator is called by its
//! island (`island/member.rs`), which catches what panics in it, and hands that to [`Node::panicked`].

mod common;
mod judging;
mod placing;
mod recovery;
mod requests;

use super::DropReason;
use super::backlog::Backlog;
use super::environment::{BindTarget, Environment, Mode};
use super::timers::Continuation;
use super::turn::Turn;
use crate::component::inputs;
use crate::component::{Binding, Estimator, Inputs, Reply, TakenAt};
use crate::fault::{Failed, Fault, discard};
use crate::lifecycle::{AsEstimator, Recipe, Slot};
use crate::message::{Payload, Stamp, Stamped};
use crate::pubsub::counted_bytes;
use common::Common;
use std::fmt;

/// One estimator with its fan-in, its health and its timers. Its island lets one thread at a time run it.
pub struct Node<E: Estimator> {
    common: Common,
    slot: Slot<AsEstimator<E>>,
    cache: <E::Input as Inputs>::Cache,
    make_cache: fn() -> <E::Input as Inputs>::Cache,
    backlog: Backlog<Deliver<E>>,
}

/// Delivers a message that has waited for a restart; returns the stamp of the emitted output, if any.
type Deliver<E> =
    Box<dyn FnOnce(&mut Node<E>, &Turn<'_>, &mut Option<<E as Estimator>::Output>) -> Option<Stamp> + Send>;

/// Number of times in a row that an estimator may continue its work before it is considered stuck.
const STUCK_AFTER: u32 = 1_000_000;

/// Arrival of a message: now, or before a restart that it has waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// Now.
    New,
    /// Earlier, before a restart; it has been counted.
    Late,
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
        let common = Common::new(number, E::HANDLES_MOVING_JOINTS, environment, &|| format!("{options:?}"));
        environment.bind(common.declaration.path, options, binding, BindTarget::Estimator(number));
        let mut node = Self {
            common,
            slot: Slot::new(Recipe::new(options, binding), environment.supervision()),
            cache: make_cache(),
            make_cache,
            backlog: Backlog::new(),
        };
        if environment.mode() != Mode::Replay {
            node.make_first(environment.start());
        }
        node
    }

    /// Takes a message of the driving input, which is the declared input number `input` and the algorithm's field `F`. If no required input
    /// is missing, the estimator runs. Returns whether there is an output in `emitted`.
    #[inline(never)]
    pub fn receive<F: TakenAt<E::Input>>(
        &mut self,
        input: usize,
        message: &Stamped<F::Payload>,
        arrival: Arrival,
        turn: &Turn<'_>,
        emitted: &mut Option<E::Output>,
    ) -> bool {
        if arrival == Arrival::New && !self.takes(input, message, turn) {
            self.keep(input, message, move |node, message, turn, emitted| {
                let has_emitted = node.receive::<F>(input, message, Arrival::Late, turn, emitted);
                has_emitted.then(|| node.stamp_like(message))
            });
            return false;
        }
        let Self { common, slot, cache, .. } = self;
        let Some(estimator) = slot.running() else { return false };
        turn.enter(common.number);
        if let Err(reason) = common.admission.admit(input, message, turn.latest()) {
            common.refuse(input, reason, message.monotonic_time, turn);
            return false;
        }
        if common.handles_moving_joints && !common.place(message.monotonic_time, turn) {
            return false;
        }
        let view = match F::snapshot(cache, message) {
            Ok(view) => view,
            Err(miss) => {
                common.miss(miss, turn);
                return false;
            }
        };
        let begun = common.begin(turn);
        let mut has_emitted = false;
        let mut called = Ok(());
        if common.handles_moving_joints {
            called = estimator.handle_transforms(&common.placing.transforms(message.monotonic_time));
        }
        // The parts of the reply are moved one by one, in each arm. Moving a whole reply costs more than the rest of a hop.
        let called = called.and_then(|()| {
            estimator.handle_input(view, |reply| {
                let Reply { output, diverged, request } = reply;
                if let Some(output) = output {
                    *emitted = Some(output);
                    has_emitted = true;
                }
                (diverged, common.take_request(request, turn))
            })
        });
        match called {
            Ok((diverged, has_asked)) => {
                common.complete(input, message.monotonic_time, begun, diverged, turn);
                common.settle(has_asked, has_emitted, turn);
                has_emitted
            }
            Err(fault) => {
                self.fail(Failed::from(fault), turn);
                false
            }
        }
    }

    /// Keeps a message of another input until the next one of the driving input.
    #[inline(never)]
    pub fn hold<F: TakenAt<E::Input>>(
        &mut self,
        input: usize,
        message: &Stamped<F::Payload>,
        arrival: Arrival,
        turn: &Turn<'_>,
    ) {
        if arrival == Arrival::New && !self.takes(input, message, turn) {
            return self.keep(input, message, move |node, message, turn, _| {
                node.hold::<F>(input, message, Arrival::Late, turn);
                None
            });
        }
        turn.enter(self.common.number);
        turn.timing().interrupt();
        match self.common.admission.admit(input, message, turn.latest()) {
            Ok(()) => {
                let displaced = F::slot(&mut self.cache).map_or(0, |slot| inputs::Slot::store(slot, message));
                for _ in 0..displaced {
                    self.common.shared.counters().drop(input, DropReason::Displaced);
                }
            }
            Err(reason) => self.common.refuse(input, reason, message.monotonic_time, turn),
        }
    }

    /// Counts a message that arrives; returns whether the estimator takes it at once.
    #[inline]
    fn takes<T>(&self, input: usize, message: &Stamped<T>, turn: &Turn<'_>) -> bool {
        if let Some(counters) = self.common.shared.counters().inputs.get(input) {
            counters.received.increment();
        }
        if turn.is_observed() {
            self.common.tell_input(input, message.stamp(), turn);
        }
        self.slot.is_running() && self.backlog.is_empty()
    }

    /// The stamp of what the estimator emits in reply to `message`.
    #[inline]
    pub fn stamp_like<T>(&self, message: &Stamped<T>) -> Stamp {
        let Stamped { monotonic_time, wall_time, .. } = *message;
        Stamp { monotonic_time, wall_time, ..self.common.template }
    }

    /// Returns whether the estimator has asked to continue at once.
    #[inline]
    pub fn is_unfinished(&self) -> bool {
        self.common.timers.continue_with.is_some()
    }

    /// Does one thing that is due, if any.
    pub fn turn(&mut self, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        turn.timing().interrupt();
        // An estimator that has been woken schedules its next wake-up.
        self.common.scheduled = None;
        if self.slot.restart_at().is_some_and(|at| at <= turn.now()) {
            self.restart(turn);
            return Next::Quiet;
        }
        if !self.slot.is_running() {
            self.schedule();
            return Next::Idle;
        }
        match self.common.timers.continue_with.take() {
            Some(Continuation::Step(step)) => return self.go_on(step, turn, emitted),
            Some(Continuation::Fail(reason)) => {
                self.fail(Failed::from(Fault::new(reason)), turn);
                return Next::Quiet;
            }
            None => {}
        }
        self.common.continued = 0;
        if let Some(deliver) = self.backlog.pop() {
            return deliver(self, turn, emitted).map_or(Next::Quiet, Next::Emitted);
        }
        if let Some(info) = self.common.timers.take(turn.now()) {
            return self.run(turn, emitted, |estimator| estimator.handle_info(info));
        }
        self.schedule();
        Next::Idle
    }

    fn go_on(&mut self, step: u32, turn: &Turn<'_>, emitted: &mut Option<E::Output>) -> Next {
        self.common.continued += 1;
        if self.common.continued <= STUCK_AFTER {
            return self.run(turn, emitted, |estimator| estimator.handle_continue(step));
        }
        self.common.continued = 0;
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
        turn.enter(self.common.number);
        let begun = self.common.begin_other(turn);
        match callback(running) {
            Ok(Reply { output, diverged, request }) => {
                *emitted = output;
                let has_asked = self.common.take_request(request, turn);
                let stamp = self.common.complete_other(begun, diverged, turn);
                self.common.settle(has_asked, emitted.is_some(), turn);
                if emitted.is_some() { Next::Emitted(stamp) } else { Next::Quiet }
            }
            Err(fault) => {
                self.fail(Failed::from(fault), turn);
                Next::Quiet
            }
        }
    }

    /// Stores a message until after the restart, when `deliver` takes it, or counts it as dropped if no restart is planned.
    #[cold]
    fn keep<T: Payload>(
        &mut self,
        input: usize,
        message: &Stamped<T>,
        deliver: impl FnOnce(&mut Self, &Stamped<T>, &Turn<'_>, &mut Option<E::Output>) -> Option<Stamp>
        + Send
        + 'static,
    ) {
        let counters = self.common.shared.counters();
        if !self.slot.is_running() && self.slot.restart_at().is_none() {
            if self.common.shared.health().is_some() {
                counters.drop(input, DropReason::Stopped);
            }
            return;
        }
        let (message, bytes) = (message.clone(), counted_bytes(message));
        let deliver: Deliver<E> = Box::new(move |node, turn, emitted| deliver(node, &message, turn, emitted));
        // Each is dropped by itself, since its `Drop` may panic.
        while let Some((oldest, dropped)) = self.backlog.make_room(bytes) {
            counters.drop(oldest, DropReason::Stopped);
            discard(dropped);
        }
        self.backlog.push(input, deliver, bytes);
    }

    /// Schedules the next wake-up of the island.
    fn schedule(&mut self) {
        let next = if self.slot.is_running() { self.common.timers.next() } else { self.slot.restart_at() };
        self.common.wake_at(next);
    }
}

impl<E: Estimator> fmt::Debug for Node<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Node").field("path", &self.common.declaration.path).finish_non_exhaustive()
    }
}
