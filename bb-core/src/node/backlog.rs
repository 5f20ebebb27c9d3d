//! Messages that wait until an estimator is restarted.

use crate::pubsub::{Bound, Held};
use std::collections::VecDeque;

/// Deliveries in order of arrival.
pub(super) struct Backlog<D> {
    waiting: VecDeque<Waiting<D>>,
    held: Held,
}

struct Waiting<D> {
    /// The number of its input.
    input: usize,
    delivery: D,
    /// The counted bytes of its message.
    bytes: usize,
}

/// The bound of an inbox.
const BOUND: Bound = Bound::of_estimator(1024);

impl<D> Backlog<D> {
    pub(super) fn new() -> Self {
        Self { waiting: VecDeque::new(), held: Held::default() }
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Takes out the oldest delivery, with its input, if one of `bytes` counted bytes does not fit beside it.
    pub(super) fn make_room(&mut self, bytes: usize) -> Option<(usize, D)> {
        if BOUND.has_room(self.held, bytes) { None } else { self.take() }
    }

    /// Keeps a delivery, for which there is room.
    pub(super) fn push(&mut self, input: usize, delivery: D, bytes: usize) {
        self.held.add(bytes);
        self.waiting.push_back(Waiting { input, delivery, bytes });
    }

    /// Takes the oldest delivery.
    pub(super) fn pop(&mut self) -> Option<D> {
        self.take().map(|(_, delivery)| delivery)
    }

    /// Drops all deliveries; returns the input of each.
    pub(super) fn clear(&mut self) -> impl Iterator<Item = usize> + '_ {
        self.held = Held::default();
        self.waiting.drain(..).map(|waiting| waiting.input)
    }

    fn take(&mut self) -> Option<(usize, D)> {
        let Waiting { input, delivery, bytes } = self.waiting.pop_front()?;
        self.held.remove(bytes);
        Some((input, delivery))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_make_room_and_all_are_reported() {
        let mut backlog = Backlog::new();
        for input in 0..BOUND.capacity + 3 {
            let oldest = backlog.make_room(0).map(|(input, ())| input);
            assert_eq!(oldest, input.checked_sub(BOUND.capacity));
            backlog.push(input, (), 0);
        }
        assert!(backlog.clear().eq(3..BOUND.capacity + 3));
        assert!(backlog.is_empty());
        // A large one takes the room of several.
        let third = BOUND.bytes / 3;
        (0..3).for_each(|input| backlog.push(input, (), third));
        let displaced: Vec<_> = std::iter::from_fn(|| backlog.make_room(2 * third)).collect();
        assert_eq!((displaced, backlog.held.bytes), (vec![(0, ()), (1, ())], third));
    }
}
