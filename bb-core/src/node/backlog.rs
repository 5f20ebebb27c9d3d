//! Messages that wait until an estimator is restarted.

use std::collections::VecDeque;

/// Deliveries in order of arrival, each with the number of its input.
pub(super) struct Backlog<D>(VecDeque<(usize, D)>);

/// The capacity of an inbox.
const CAPACITY: usize = 1024;

impl<D> Backlog<D> {
    pub(super) fn new() -> Self {
        Self(VecDeque::new())
    }

    #[inline]
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Keeps a delivery. Returns the input of the oldest one if that was dropped to make room.
    pub(super) fn push(&mut self, input: usize, delivery: D) -> Option<usize> {
        let dropped = if self.0.len() == CAPACITY { self.0.pop_front() } else { None };
        self.0.push_back((input, delivery));
        dropped.map(|(input, _)| input)
    }

    /// Takes the oldest delivery.
    pub(super) fn pop(&mut self) -> Option<D> {
        self.0.pop_front().map(|(_, delivery)| delivery)
    }

    /// Drops all deliveries; returns the input of each.
    pub(super) fn clear(&mut self) -> impl Iterator<Item = usize> + '_ {
        self.0.drain(..).map(|(input, _)| input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_make_room_and_all_are_told() {
        let mut backlog = Backlog::new();
        for input in 0..CAPACITY + 3 {
            assert_eq!(backlog.push(input, ()), input.checked_sub(CAPACITY));
        }
        assert!(backlog.clear().eq(3..CAPACITY + 3));
        assert!(backlog.is_empty());
    }
}
