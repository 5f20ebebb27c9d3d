//! A bounded queue that allocates only when it is created.

#[cfg_attr(not(feature = "alloc"), path = "ring/inline.rs")]
mod slots;

use self::slots::Slots;

/// Values up to the number that it was made for, oldest first; inline, up to `N`.
#[derive(Clone, Debug)]
pub(in crate::navigation) struct Ring<T, const N: usize> {
    slots: Slots<T, N>,
    first: usize,
    len: usize,
}

impl<T, const N: usize> Ring<T, N> {
    pub(super) fn new(room: usize) -> Self {
        Self { slots: slots::empty::<T, N>(room), first: 0, len: 0 }
    }

    pub(super) fn clear(&mut self) {
        while self.pop().is_some() {}
    }

    pub(in crate::navigation) fn len(&self) -> usize {
        self.len
    }

    pub(in crate::navigation) fn is_full(&self) -> bool {
        self.len == self.slots.len()
    }

    fn slot(&self, index: usize) -> usize {
        let slot = self.first + index;
        if slot < self.slots.len() { slot } else { slot - self.slots.len() }
    }

    pub(in crate::navigation) fn get(&self, index: usize) -> Option<&T> {
        if index < self.len { self.slots[self.slot(index)].as_ref() } else { None }
    }

    pub(in crate::navigation) fn get_mut(&mut self, index: usize) -> Option<&mut T> {
        if index < self.len { self.slots[self.slot(index)].as_mut() } else { None }
    }

    pub(in crate::navigation) fn last(&self) -> Option<&T> {
        self.len.checked_sub(1).and_then(|last| self.get(last))
    }

    /// The number of values at the front for which a condition holds, which holds for none after them. The search begins at the back.
    pub(in crate::navigation) fn count_while(&self, holds: impl Fn(&T) -> bool) -> usize {
        let last = (0..self.len).rev().find(|index| self.get(*index).is_some_and(&holds));
        last.map_or(0, |index| index + 1)
    }

    /// Appends a value; the oldest is removed if there is no room.
    pub(in crate::navigation) fn push(&mut self, value: T) {
        if self.is_full() {
            self.pop_front();
        }
        let slot = self.slot(self.len);
        self.slots[slot] = Some(value);
        self.len += 1;
    }

    pub(super) fn pop(&mut self) -> Option<T> {
        self.len = self.len.checked_sub(1)?;
        let slot = self.slot(self.len);
        self.slots[slot].take()
    }

    pub(in crate::navigation) fn pop_front(&mut self) -> Option<T> {
        let value = self.slots.get_mut(self.first)?.take()?;
        self.first = self.slot(1);
        self.len -= 1;
        Some(value)
    }

    /// Removes the oldest value if a condition holds for it.
    pub(in crate::navigation) fn pop_front_if(&mut self, holds: impl Fn(&T) -> bool) -> Option<T> {
        if self.get(0).is_some_and(holds) { self.pop_front() } else { None }
    }

    /// Inserts a value before the one at `index`. If there is no room, the newest is removed.
    pub(in crate::navigation) fn insert(&mut self, index: usize, value: T) {
        if index >= self.slots.len() {
            return;
        }
        if self.is_full() {
            self.pop();
        }
        self.push(value);
        for i in (index..self.len - 1).rev() {
            let (this, next) = (self.slot(i), self.slot(i + 1));
            self.slots.swap(this, next);
        }
    }

    /// The number of values for which there is room.
    pub(in crate::navigation) fn room(&self) -> usize {
        self.slots.len()
    }

    /// The values, in any order.
    pub(in crate::navigation) fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.slots.iter_mut().flatten()
    }

    pub(in crate::navigation) fn iter(&self) -> impl DoubleEndedIterator<Item = &T> {
        (0..self.len).filter_map(|index| self.get(index))
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
        let mut ring = Ring::<i32, 4>::new(4);
        for value in [1, 2, 4, 5] {
            ring.push(value);
        }
        ring.push(6);
        assert_eq!(all(&ring), [2, 4, 5, 6]);
        ring.insert(1, 3);
        assert_eq!(all(&ring), [2, 3, 4, 5]);
        assert_eq!((ring.count_while(|x| *x < 5), ring.count_while(|x| *x < 0)), (3, 0));
        ring.pop();
        ring.pop();
        assert_eq!((all(&ring), ring.len()), (vec![2, 3], 2));
        ring.insert(2, 7);
        ring.insert(0, 1);
        assert_eq!(all(&ring), [1, 2, 3, 7]);
        assert_eq!((ring.pop_front(), ring.pop_front(), ring.len()), (Some(1), Some(2), 2));
    }
}
