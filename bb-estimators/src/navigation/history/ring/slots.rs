//! Storage of the values on the heap, allocated from the beginning. Hundreds of kilobytes are too much for a thread's stack, which in a
//! build without optimisation holds a copy for each function they pass through.

use alloc::boxed::Box;

pub(super) type Slots<T, const N: usize> = Box<[Option<T>]>;

pub(super) fn empty<T, const N: usize>(room: usize) -> Slots<T, N> {
    core::iter::repeat_with(|| None).take(room).collect()
}
