//! How callers reach an estimator in its island.

use super::Robot;
use crate::component::Estimator;
use crate::journal::{Event, Request};
use crate::message::Stamp;
use crate::node::{CallError, IslandState, Member, Node, Turn, publish, take_turn};
use crate::time::MonotonicTime;

/// A function called with an estimator, and the slot for what it emits.
type Call<'a, E> = dyn FnMut(&mut Node<E>, &Turn<'_>, &mut Option<<E as Estimator>::Output>) -> Option<Stamp> + 'a;

/// A function called with an estimator once it is free. A separate type: rustc checks it once, instead of in every
/// function that takes it.
#[allow(missing_debug_implementations)]
pub struct Visit<'a, E: Estimator> {
    pub(super) estimator: usize,
    pub(super) request: Request,
    pub(super) call: &'a mut Call<'a, E>,
    /// Why it was not called.
    pub(super) error: &'a mut Option<CallError>,
}

/// Enters the estimator's island as a caller, publishes what it emits, and does what is due afterwards.
pub fn visit<M: Member>(
    wiring: &<M::State as IslandState>::Wiring,
    now: MonotonicTime,
    visit: Visit<'_, M::Estimator>,
) {
    let Visit { estimator, request, call, error } = visit;
    let line = Event::Request { estimator, request };
    let called = M::State::find(wiring).call(wiring, now, line, |state, turn| {
        let mut emitted = None;
        if let Some(stamp) = call(M::node(state), turn, &mut emitted) {
            publish::<M>(wiring, state, &mut emitted, stamp, turn);
        }
        take_turn::<M>(state, wiring, turn);
    });
    *error = called.err();
}

/// A handle that requests can be sent to: that of an estimator.
pub trait Visitable<R: Robot>: Copy {
    /// The estimator.
    type Estimator: Estimator;
    /// Its number.
    #[doc(hidden)]
    fn number(self) -> usize;
    /// Calls `visit` with it once it is free.
    #[doc(hidden)]
    fn visit(self, wiring: &R::Wiring, now: MonotonicTime, visit: Visit<'_, Self::Estimator>);
}
