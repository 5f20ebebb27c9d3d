//! How callers reach an estimator in its island.

use super::Robot;
use crate::component::Estimator;
use crate::journal::{Event, Request};
use crate::message::Stamp;
use crate::node::{CallError, Island, IslandState, Node, Turn};
use crate::time::MonotonicTime;

/// What is called with an estimator, and the slot for what it emits.
type Call<'a, E> = dyn FnMut(&mut Node<E>, &Turn<'_>, &mut Option<<E as Estimator>::Output>) -> Option<Stamp> + 'a;

/// What is called with an estimator once that is free. A type of its own, which rustc checks once, not in every function
/// that it is given to.
#[allow(missing_debug_implementations)]
pub struct Visit<'a, E: Estimator> {
    pub(super) estimator: usize,
    pub(super) request: Request,
    pub(super) call: &'a mut Call<'a, E>,
    /// Why it was not called.
    pub(super) error: &'a mut Option<CallError>,
}

impl<E: Estimator> Visit<'_, E> {
    /// Enters the estimator's island as a caller: `node` finds the estimator there, `emit` publishes what it emits, and
    /// `finish` does what is due afterwards.
    pub fn enter<S: IslandState>(
        self,
        island: &Island<S>,
        wiring: &S::Wiring,
        now: MonotonicTime,
        node: impl Fn(&mut S) -> &mut Node<E>,
        emit: impl Fn(&mut S, &mut Option<E::Output>, Stamp, &Turn<'_>),
        finish: impl Fn(&mut S, &Turn<'_>),
    ) {
        let Self { estimator, request, call, error } = self;
        let line = Event::Request { estimator, request };
        let called = island.call(wiring, now, line, |state, turn| {
            let mut emitted = None;
            if let Some(stamp) = call(node(state), turn, &mut emitted) {
                emit(state, &mut emitted, stamp, turn);
            }
            finish(state, turn);
        });
        *error = called.err();
    }
}

/// What answers requests: the handle of an estimator.
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
