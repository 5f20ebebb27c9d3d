//! An estimator that is an island of its own, with one input: most are. The island's code is here, once for all of them; the
//! expansion of `robot!` provides what differs.

use super::member::{Member, OptionsOf, OutputOf, act, alone, emit, enter, receive};
use super::{Environment, Island, IslandState, IslandWiring, Key};
use crate::component::{Binding, EmittedAt, Estimator, OptionsList, TakenAt};
use crate::declaration::IslandDeclaration;
use crate::declaration::estimator::InletDeclaration;
use crate::message::{Payload, Stamp, Stamped};
use crate::node::act::Act;
use crate::node::{Node, Turn};
use crate::pubsub::{DynamicMessage, Topic};
use crate::time::MonotonicTime;
use std::convert::identity;

/// Implemented by `robot!` for each estimator that is an island of its own, with one input.
pub trait Alone: Sized + 'static {
    /// The robot's wiring.
    type Wiring: IslandWiring;
    /// The estimator's type.
    type Estimator: Estimator;
    /// Payload of the input's publisher.
    type Source: Payload;
    /// Input of the estimator.
    type Input: TakenAt<<Self::Estimator as Estimator>::Input>;
    /// Output of the estimator, or the first of several.
    type Output: EmittedAt<<Self::Estimator as Estimator>::Output>;
    /// Number of the estimator, and the source and target of its messages.
    const INLET: Inlet<Self::Source, TakenBy<Self>>;

    /// Finds the island and the output's topic in the wiring.
    fn find(wiring: &Self::Wiring) -> (&Island<Solo<Self>>, &Topic<PayloadOf<Self>>);

    /// Publishes the emitted outputs, see [`Member::publish`]. By default the estimator has one output, which no estimator takes.
    #[inline]
    fn publish(
        wiring: &Self::Wiring,
        emitted: &mut Option<<Self::Estimator as Estimator>::Output>,
        stamp: Stamp,
        turn: &Turn<'_>,
    ) {
        let (_, topic) = Self::find(wiring);
        emit::<Self::Output, _>(emitted, stamp, turn, Self::INLET.publisher, topic);
    }

    /// Returns the emission of that message, see [`Member::emitted`].
    fn emitted(output: usize, message: &DynamicMessage) -> Option<<Self::Estimator as Estimator>::Output> {
        if output == 0 { alone::<Self::Output, _>(message) } else { None }
    }
}

type TakenBy<A> = <<A as Alone>::Input as TakenAt<<<A as Alone>::Estimator as Estimator>::Input>>::Payload;
type PayloadOf<A> = <<A as Alone>::Output as EmittedAt<<<A as Alone>::Estimator as Estimator>::Output>>::Payload;

/// Source and target of the messages of an estimator that is an island of its own.
#[allow(missing_debug_implementations)]
pub struct Inlet<P, T> {
    /// The estimator's number.
    pub number: usize,
    /// The publisher of its messages, as the island numbers them.
    pub entry: usize,
    /// The estimator's publisher, or the first of several.
    pub publisher: usize,
    /// The publisher's message as the input takes it.
    pub feed: fn(&Stamped<P>) -> &Stamped<T>,
}

/// The island of a single estimator.
#[allow(missing_debug_implementations)]
pub struct Solo<A: Alone>(Node<A::Estimator>);

impl<A: Alone> IslandState for Solo<A> {
    type Wiring = A::Wiring;
    type Message = Stamped<A::Source>;
    const DECLARATION: IslandDeclaration = {
        let estimator = &A::Wiring::ESTIMATORS[A::INLET.number];
        IslandDeclaration {
            number: estimator.island,
            name: estimator.path,
            worker: estimator.worker,
            is_measured: estimator.health.latency_budget_nanos.is_some(),
            estimators: &[A::INLET.number],
            inlets: &[InletDeclaration { entry: A::INLET.entry, inputs: &[(A::INLET.number, 0)] }],
        }
    };

    #[inline(always)]
    fn find(wiring: &A::Wiring) -> &Island<Self> {
        A::find(wiring).0
    }

    #[inline]
    fn deliver(&mut self, wiring: &A::Wiring, message: &Stamped<A::Source>, turn: &Turn<'_>) {
        receive::<A, A::Input>(self, wiring, 0, (A::INLET.feed)(message), turn);
    }

    fn act(&mut self, wiring: &A::Wiring, estimator: usize, act: Act<'_, '_>) -> bool {
        estimator == A::INLET.number && self::act::<A>(self, wiring, act)
    }
}

impl<A: Alone> Member for A {
    type State = Solo<A>;
    type Estimator = A::Estimator;
    const NUMBER: usize = A::INLET.number;

    #[inline(always)]
    fn node(island: &mut Solo<A>) -> &mut Node<A::Estimator> {
        &mut island.0
    }

    #[inline]
    fn publish(
        wiring: &A::Wiring,
        _: &mut Solo<A>,
        emitted: &mut Option<OutputOf<A>>,
        stamp: Stamp,
        turn: &Turn<'_>,
    ) {
        <A as Alone>::publish(wiring, emitted, stamp, turn);
    }

    fn emitted(output: usize, message: &DynamicMessage) -> Option<OutputOf<A>> {
        <A as Alone>::emitted(output, message)
    }
}

/// Creates the estimator and its island: see [`start`](super::start).
pub fn start_alone<A: Alone>(
    options: &OptionsList,
    component: usize,
    binding: Binding<OptionsOf<A>>,
    environment: &Environment,
) -> Island<Solo<A>> {
    Island::new(Solo(super::start::<A>(options, component, binding, environment)))
}

/// Publishes a message of a sensor or a service that only this estimator takes, and delivers it.
#[inline]
pub fn publish_to<A: Alone>(
    wiring: &A::Wiring,
    publisher: usize,
    topic: &Topic<A::Source>,
    message: &Stamped<A::Source>,
    now: MonotonicTime,
) {
    let line = wiring.environment().publish(publisher, topic, message, now);
    enter_alone::<A>(wiring, now, line, message);
}

/// Delivers a message to the island of the estimator directly, or keeps it for the thread that holds the island; `line` is that
/// of the message in the journal.
#[inline]
pub fn enter_alone<A: Alone>(wiring: &A::Wiring, now: MonotonicTime, line: u64, message: &Stamped<A::Source>) {
    enter::<Solo<A>, _>(
        wiring,
        now,
        Key { entry: A::INLET.entry, line },
        message,
        <Solo<A> as IslandState>::deliver,
        identity,
    );
}
