//! Storage of the values inline, without a heap.

pub(super) type Slots<T, const N: usize> = [Option<T>; N];

pub(super) fn empty<T, const N: usize>(_: usize) -> Slots<T, N> {
    core::array::from_fn(|_| None)
}
