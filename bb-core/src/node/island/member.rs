//! An estimator in its island. The expansion of `robot!` provides its location and the destinations of its outputs. The code that
//! uses them is here, once for all estimators.

use super::act::Act;
use super::{Island, IslandIn, IslandState, IslandWiring as _, Key};
use crate::component::{Binding, EmittedAt, Estimator, Inputs, OptionsList, Outputs, TakenAt};
use crate::fault::of_panic;
use crate::message::{Payload, Stamp, Stamped, copied};
use crate::node::emission::copy_failed;
use crate::node::{Emitting, Next, Node, Turn};
use crate::pubsub::{DynamicMessage, Topic};
use crate::time::MonotonicTime;
use std::panic::resume_unwind;

type WiringOf<M> = <<M as Member>::State as IslandState>::Wiring;
type InputOf<M> = <<M as Member>::Estimator as Estimator>::Input;
pub(super) type OutputOf<M> = <<M as Member>::Estimator as Estimator>::Output;
pub(super) type OptionsOf<M> = <<M as Member>::Estimator as Estimator>::Options;

/// Implemented by `robot!` for each estimator.
pub trait Member {
    /// Its island.
    type State: IslandState;
    /// The estimator's type.
    type Estimator: Estimator;
    /// Its number.
    const NUMBER: usize;

    /// Its node in the island.
    fn node(island: &mut Self::State) -> &mut Node<Self::Estimator>;

    /// Publishes the emitted outputs, one by one.
    fn publish(
        wiring: &WiringOf<Self>,
        island: &mut Self::State,
        emitted: &mut Option<OutputOf<Self>>,
        stamp: Stamp,
        turn: &Turn<'_>,
    );

    /// The slots of its inputs. A single input is the driver's, whose message is not kept.
    fn cache() -> <InputOf<Self> as Inputs>::Cache {
        Default::default()
    }

    /// A function that emits a message only at the output with that number; `None` if the payload's type differs.
    fn emitted(output: usize, message: &DynamicMessage) -> Option<OutputOf<Self>> {
        if output == 0 { alone::<<OutputOf<Self> as Outputs>::Only, _>(message) } else { None }
    }
}

/// Emits `message` alone at the output `F`. No publisher is charged if the payload's `Clone` panics: the message is a recorded one.
pub fn alone<F: EmittedAt<O>, O>(message: &DynamicMessage) -> Option<O> {
    let mut panic = None;
    let copy = copied(message.downcast::<F::Payload>()?, &mut panic);
    if let Some(fault) = panic.map(of_panic) {
        tracing::error!(%fault, "a recorded message failed where it was copied");
    }
    copy.map(|message| F::alone(message.payload))
}

/// Publishes the output `F` if it was emitted, and no estimator takes it.
#[inline]
pub fn emit<F: EmittedAt<O>, O>(
    emitted: &mut Option<O>,
    stamp: Stamp,
    turn: &Turn<'_>,
    publisher: usize,
    topic: &Topic<F::Payload>,
) {
    if let Some(payload) = F::take(emitted) {
        let emission = stamp.message(payload);
        turn.emit(publisher, topic, &emission);
        turn.release(topic, emission);
    }
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

/// Delivers a message to the estimator's input with that number, publishes its outputs, and lets it continue if it asks to.
#[inline]
pub fn receive<M: Member, F: TakenAt<InputOf<M>>>(
    island: &mut M::State,
    wiring: &WiringOf<M>,
    input: usize,
    message: &Stamped<F::Payload>,
    turn: &Turn<'_>,
) {
    let mut emitted = None;
    if let Some(stamp) = M::node(island).receive::<F>(input, message, turn, &mut emitted) {
        publish::<M>(wiring, island, &mut emitted, stamp, turn);
    }
    if M::node(island).is_unfinished() {
        take_turn::<M>(island, wiring, turn);
    }
}

/// Publishes an estimator's outputs; a panic in one is attributed to that output.
#[inline]
fn publish<M: Member>(
    wiring: &WiringOf<M>,
    island: &mut M::State,
    emitted: &mut Option<OutputOf<M>>,
    stamp: Stamp,
    turn: &Turn<'_>,
) {
    let emitting = Emitting::new(M::NUMBER);
    M::publish(wiring, island, emitted, stamp, turn);
    // Other islands may have run, and the message was dropped: neither is charged to a later callback.
    turn.timing().interrupt();
    emitting.done();
}

/// Performs an act on an estimator; returns `false` if it cannot emit that message.
#[cold]
pub fn act<M: Member>(island: &mut M::State, wiring: &WiringOf<M>, act: Act<'_, '_>) -> bool {
    match act {
        Act::Turn(turn) => take_turn::<M>(island, wiring, turn),
        Act::Handle(entry, turn) => {
            let mut emitted = None;
            if let Next::Emitted(stamp) = M::node(island).handle(entry, turn, &mut emitted) {
                publish::<M>(wiring, island, &mut emitted, stamp, turn);
            }
            take_turn::<M>(island, wiring, turn);
        }
        Act::Visit(visit, turn) => {
            let mut emitted: Option<OutputOf<M>> = None;
            if let Some(stamp) = visit(M::node(island), turn, &mut emitted) {
                publish::<M>(wiring, island, &mut emitted, stamp, turn);
            }
            take_turn::<M>(island, wiring, turn);
        }
        Act::BeginReplay => M::node(island).begin_replay(),
        Act::Emit(message, turn) => {
            let output = M::node(island).output_at(message.path());
            let mut emitted = output.and_then(|output| M::emitted(output, message));
            if emitted.is_none() {
                return false;
            }
            publish::<M>(wiring, island, &mut emitted, message.stamp(), turn);
        }
    }
    true
}

/// Does all that is due in an estimator.
#[cold]
fn take_turn<M: Member>(island: &mut M::State, wiring: &WiringOf<M>, turn: &Turn<'_>) {
    loop {
        let mut emitted = None;
        match M::node(island).turn(turn, &mut emitted) {
            Next::Idle => return,
            Next::Quiet => {}
            Next::Emitted(stamp) => publish::<M>(wiring, island, &mut emitted, stamp, turn),
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
    S::find(wiring).enter(wiring, now, key, direct, || copy_for::<S, T>(wiring, key.entry, message).map(keep));
}

/// Copies a message for an island that another thread holds. The publisher is charged if the payload's `Clone` panics; this island
/// and those after it get the message all the same.
#[cold]
fn copy_for<S: IslandState, T: Payload>(
    wiring: &S::Wiring,
    entry: usize,
    message: &Stamped<T>,
) -> Option<Stamped<T>> {
    let mut panic = None;
    let copy = copied(message, &mut panic);
    if let Some(panic) = panic {
        let environment = wiring.environment();
        let mut inlets = S::DECLARATION.inlets.iter().filter(|inlet| inlet.entry == entry);
        let input = inlets.find_map(|inlet| inlet.inputs.first());
        let source = input.and_then(|(estimator, input)| {
            environment.node(*estimator).declaration().inputs.get(*input).map(|input| input.source)
        });
        match source {
            Some(path) => copy_failed(environment, path, panic),
            None => resume_unwind(panic),
        }
    }
    copy
}

/// The type-erased form of an island of a wiring.
pub fn island<S: IslandState + 'static>(wiring: &S::Wiring) -> &dyn IslandIn<S::Wiring>
where
    Island<S>: IslandIn<S::Wiring>,
{
    S::find(wiring)
}
