//! A bounded queue that allocates only when it is created.

#[cfg(feature = "std")]
use std::boxed::Box;

/// Storage of the values: with a heap, they are allocated there from the beginning. Hundreds of kilobytes are too much for a thread's
/// stack, which in a build without optimisation holds a copy for each function they pass through.
#[cfg(feature = "std")]
type Slots<T, const N: usize> = Box<[Option<T>]>;
#[cfg(not(feature = "std"))]
type Slots<T, const N: usize> = [Option<T>; N];

/// Up to `N` values, oldest first.
#[derive(Clone, Debug)]
pub(super) struct Ring<T, const N: usize> {
    slots: Slots<T, N>,
    first: usize,
    len: usize,
}

impl<T, const N: usize> Ring<T, N> {
    pub(super) fn new() -> Self {
        #[cfg(feature = "std")]
        let slots = core::iter::repeat_with(|| None).take(N).collect();
        #[cfg(not(feature = "std"))]
        let slots = core::array::from_fn(|_| None);
        Self { slots, first: 0, len: 0 }
    }

    pub(super) fn clear(&mut self) {
        self.truncate(0);
        self.first = 0;
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn get(&self, index: usize) -> Option<&T> {
        if index >= self.len {
            return None;
        }
        self.slots[(self.first + index) % N].as_ref()
    }

    /// The number of values at the front for which a condition holds, which holds for none after them. The search begins at the back.
    pub(super) fn count_while(&self, holds: impl Fn(&T) -> bool) -> usize {
        let last = (0..self.len).rev().find(|index| self.get(*index).is_some_and(&holds));
        last.map_or(0, |index| index + 1)
    }

    /// Appends a value; the oldest is removed if there is no room.
    pub(super) fn push(&mut self, value: T) {
        if self.len == N {
            self.pop_front();
        }
        self.slots[(self.first + self.len) % N] = Some(value);
        self.len += 1;
    }

    pub(super) fn pop_front(&mut self) -> Option<T> {
        if self.len == 0 {
            return None;
        }
        let value = self.slots[self.first].take();
        self.first = (self.first + 1) % N;
        self.len -= 1;
        value
    }

    /// Inserts a value before the one at `index`. If there is no room, the newest is removed.
    pub(super) fn insert(&mut self, index: usize, value: T) {
        if index >= N {
            return;
        }
        self.truncate(N - 1);
        self.push(value);
        for i in (index..self.len - 1).rev() {
            self.slots.swap((self.first + i) % N, (self.first + i + 1) % N);
        }
    }

    /// Keeps only the oldest `len` values.
    pub(super) fn truncate(&mut self, len: usize) {
        while self.len > len {
            self.len -= 1;
            self.slots[(self.first + self.len) % N] = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(ring: &Ring<i32, 4>) -> Vec<i32> {
        (0..ring.len()).filter_map(|index| ring.get(index).copied()).collect()
    }

    #[test]
    fn there_is_never_more_than_there_is_room_for() {
        let mut ring = Ring::<i32, 4>::new();
        for value in [1, 2, 4, 5] {
            ring.push(value);
        }
        ring.push(6);
        assert_eq!(all(&ring), [2, 4, 5, 6]);
        ring.insert(1, 3);
        assert_eq!(all(&ring), [2, 3, 4, 5]);
        assert_eq!((ring.count_while(|x| *x < 5), ring.count_while(|x| *x < 0)), (3, 0));
        ring.truncate(2);
        assert_eq!((all(&ring), ring.len()), (vec![2, 3], 2));
        ring.insert(2, 7);
        ring.insert(0, 1);
        assert_eq!(all(&ring), [1, 2, 3, 7]);
        assert_eq!((ring.pop_front(), ring.pop_front(), ring.len()), (Some(1), Some(2), 2));
    }
}
