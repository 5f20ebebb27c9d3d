//! Messages that wait for an estimator that is being restarted.

use super::running::Node;
use super::turn::Turn;
use crate::component::{Estimator, TakenAt};
use crate::message::{Stamp, Stamped};
use std::collections::VecDeque;

/// Messages in the order in which they came, whatever their inputs.
pub(super) struct Backlog<E: Estimator>(VecDeque<Delivery<E>>);

/// A message that was cloned, with the input it is for.
struct Delivery<E: Estimator> {
    input: usize,
    deliver: Deliver<E>,
}

/// Hands a message to its estimator; the stamp of what it emitted, if anything.
pub(super) type Deliver<E> =
    Box<dyn FnOnce(&mut Node<E>, &Turn<'_>, &mut Option<<E as Estimator>::Output>) -> Option<Stamp> + Send>;

/// As many as an inbox holds.
const CAPACITY: usize = 1024;

impl<E: Estimator> Backlog<E> {
    pub(super) fn new() -> Self {
        Self(VecDeque::new())
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Keeps a clone of a message; the input of the oldest one, if that had to make room.
    pub(super) fn push<F: TakenAt<E::Input>>(
        &mut self,
        input: usize,
        message: &Stamped<F::Payload>,
    ) -> Option<usize> {
        let dropped = if self.0.len() == CAPACITY { self.0.pop_front() } else { None };
        let message = message.clone();
        self.0.push_back(Delivery {
            input,
            deliver: Box::new(move |node, turn, emitted| node.take_in::<F>(input, &message, turn, emitted)),
        });
        dropped.map(|dropped| dropped.input)
    }

    /// Takes the oldest message; calling what is returned hands it to the estimator.
    pub(super) fn pop(&mut self) -> Option<Deliver<E>> {
        self.0.pop_front().map(|delivery| delivery.deliver)
    }

    /// Drops all; the input of each.
    pub(super) fn clear(&mut self) -> impl Iterator<Item = usize> + '_ {
        self.0.drain(..).map(|delivery| delivery.input)
    }
}
