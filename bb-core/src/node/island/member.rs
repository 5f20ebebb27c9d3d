//! An estimator in its island. The expansion of `robot!` provides its location and the destinations of its outputs. The code that
//! uses them is here, once for all estimators.

use super::{AnyIsland, IslandState, Key, Placed};
use crate::component::{Binding, EmittedAt, Estimator, Inputs, OptionsList, Outputs, TakenAt};
use crate::fault::Panic;
use crate::message::{Payload, Stamp, Stamped};
use crate::node::act::Act;
use crate::node::{Arrival, Next, Node, Turn};
use crate::pubsub::{DynamicMessage, Topic, counted_bytes};
use crate::time::MonotonicTime;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

type WiringOf<M> = <<M as Member>::State as IslandState>::Wiring;
type InputOf<M> = <<M as Member>::Estimator as Estimator>::Input;
pub(super) type OutputOf<M> = <<M as Member>::Estimator as Estimator>::Output;
pub(super) type OptionsOf<M> = <<M as Member>::Estimator as Estimator>::Options;

/// Implemented by `robot!` for each estimator.
pub trait Member {
    /// Island of the estimator.
    type State: IslandState;
    /// The estimator's type.
    type Estimator: Estimator;
    /// Number of the estimator.
    const NUMBER: usize;

    /// Returns the estimator's node in the island.
    fn node(island: &mut Self::State) -> &mut Node<Self::Estimator>;

    /// Publishes the emitted outputs, one by one.
    fn publish(
        wiring: &WiringOf<Self>,
        island: &mut Self::State,
        emitted: &mut Option<OutputOf<Self>>,
        stamp: Stamp,
        turn: &Turn<'_>,
    );

    /// The slots of its inputs. A single input is the driving one, whose message is not kept.
    fn cache() -> <InputOf<Self> as Inputs>::Cache {
        Default::default()
    }

    /// A function that emits a message only at the output with that number; `None` if the payload's type differs.
    fn emitted(output: usize, message: &DynamicMessage) -> Option<OutputOf<Self>> {
        if output == 0 { alone::<<OutputOf<Self> as Outputs>::Only, _>(message) } else { None }
    }
}

/// Emits `message` alone at the output `F`.
pub fn alone<F: EmittedAt<O>, O>(message: &DynamicMessage) -> Option<O> {
    message.downcast::<F::Payload>().map(F::alone)
}

/// Publishes what was emitted at the output `F`, which no estimator takes.
#[inline]
pub fn emit<F: EmittedAt<O>, O>(
    emitted: &mut Option<O>,
    stamp: Stamp,
    turn: &Turn<'_>,
    publisher: usize,
    topic: &Topic<F::Payload>,
) {
    F::each(emitted, stamp, |message| turn.emit(publisher, topic, message));
}

/// Creates an estimator, whose options are those of the component with that number.
pub fn start<M: Member>(
    options: &OptionsList,
    component: usize,
    binding: Binding<OptionsOf<M>>,
    environment: &super::Environment,
) -> Node<M::Estimator> {
    Node::new(M::NUMBER, options.of(component), binding, M::cache, environment)
}

/// The turn of an estimator: delivers a message to its driving input, which has this number, publishes what it emits, and lets it
/// continue if it asks to.
///
/// A panic in the turn, whatever in it panics, is one of the estimator. The turns of those that take its outputs catch their own.
#[inline]
pub fn receive<M: Member, F: TakenAt<InputOf<M>>>(
    island: &mut M::State,
    wiring: &WiringOf<M>,
    input: usize,
    message: &Stamped<F::Payload>,
    turn: &Turn<'_>,
) {
    let taken = catch_unwind(AssertUnwindSafe(|| {
        let mut emitted = None;
        let node = M::node(island);
        if node.receive::<F>(input, message, Arrival::New, turn, &mut emitted) {
            let stamp = node.stamp_like(message);
            publish::<M>(wiring, island, &mut emitted, stamp, turn);
        }
    }));
    if let Err(panic) = taken {
        M::node(island).panicked(panic, turn);
    }
    if M::node(island).is_unfinished() {
        act::<M>(island, wiring, Act::Turn(turn));
    }
}

/// The turn of an estimator that gets a message of another input than the driving one.
#[inline]
pub fn hold<M: Member, F: TakenAt<InputOf<M>>>(
    island: &mut M::State,
    input: usize,
    message: &Stamped<F::Payload>,
    turn: &Turn<'_>,
) {
    let node = M::node(island);
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| node.hold::<F>(input, message, Arrival::New, turn))) {
        node.panicked(panic, turn);
    }
}

/// Publishes an estimator's outputs.
#[inline]
fn publish<M: Member>(
    wiring: &WiringOf<M>,
    island: &mut M::State,
    emitted: &mut Option<OutputOf<M>>,
    stamp: Stamp,
    turn: &Turn<'_>,
) {
    M::publish(wiring, island, emitted, stamp, turn);
    // Other islands may have run, and the message was dropped: neither is charged to a later callback.
    turn.timing().interrupt();
}

/// Performs an act on an estimator, and then all that is due; returns `false` if it cannot emit that message.
#[cold]
pub fn act<M: Member>(island: &mut M::State, wiring: &WiringOf<M>, act: Act<'_, '_>) -> bool {
    drive(&mut Seat::<M> { island, wiring }, act)
}

/// An estimator in its island, whatever its type.
trait Steps {
    /// Performs an act, or does one thing that is due, and publishes what the estimator emits.
    fn step(&mut self, act: Option<Act<'_, '_>>, turn: &Turn<'_>) -> Next;
    /// Begins a replay, see [`Node::begin_replay`].
    fn begin_replay(&mut self);
    /// Handles a panic, see [`Node::panicked`].
    fn panicked(&mut self, panic: Panic, turn: &Turn<'_>);
}

struct Seat<'a, M: Member> {
    island: &'a mut M::State,
    wiring: &'a WiringOf<M>,
}

impl<M: Member> Steps for Seat<'_, M> {
    fn step(&mut self, act: Option<Act<'_, '_>>, turn: &Turn<'_>) -> Next {
        let Self { island, wiring } = self;
        let (node, mut emitted) = (M::node(island), None);
        let next = node.step(act, M::emitted, turn, &mut emitted);
        if let Next::Emitted(stamp) = next {
            publish::<M>(wiring, island, &mut emitted, stamp, turn);
        }
        next
    }

    fn begin_replay(&mut self) {
        M::node(self.island).begin_replay();
    }

    fn panicked(&mut self, panic: Panic, turn: &Turn<'_>) {
        M::node(self.island).panicked(panic, turn);
    }
}

fn drive(member: &mut dyn Steps, act: Act<'_, '_>) -> bool {
    let (turn, is_recorded) = match &act {
        Act::Turn(turn) | Act::Handle(_, turn) | Act::Visit(_, turn) => (*turn, false),
        Act::Emit(_, turn) => (*turn, true),
        Act::BeginReplay => {
            member.begin_replay();
            return true;
        }
    };
    let mut act = Some(act);
    loop {
        let stepped = catch_unwind(AssertUnwindSafe(|| member.step(act.take(), turn)));
        let next = stepped.unwrap_or_else(|panic| {
            member.panicked(panic, turn);
            Next::Quiet
        });
        match next {
            Next::Idle => return !is_recorded,
            // What is due is in the journal, too.
            Next::Quiet | Next::Emitted(_) if is_recorded => return true,
            Next::Quiet | Next::Emitted(_) => {}
        }
    }
}

/// Delivers a message to an island directly, or keeps it for the thread that holds the island.
#[inline]
pub fn enter<S: IslandState, T: Payload>(
    wiring: &S::Wiring,
    now: MonotonicTime,
    key: Key,
    message: &Stamped<T>,
    deliver: impl FnOnce(&mut S, &S::Wiring, &Stamped<T>, &Turn<'_>),
    keep: impl FnOnce(Stamped<T>) -> S::Message,
) {
    let direct = |state: &mut S, turn: &Turn<'_>| deliver(state, wiring, message, turn);
    S::find(wiring).enter(wiring, now, key, direct, || (keep(message.clone()), counted_bytes(message)));
}

/// The type-erased form of an island of a wiring.
pub fn island<S: IslandState + 'static>(wiring: &Arc<S::Wiring>) -> Box<dyn AnyIsland>
where
    Placed<S>: AnyIsland,
{
    Box::new(Placed::<S>(Arc::clone(wiring)))
}
