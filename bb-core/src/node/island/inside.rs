//! Which robots' islands a thread is inside: code that they call must not wait for an island of the same robot.

use std::cell::Cell;
use std::fmt;
use std::ops::{Deref, DerefMut};

#[cfg(not(loom))]
thread_local! {
    static INSIDE: Cell<u64> = const { Cell::new(0) };
}
#[cfg(loom)]
loom::thread_local! {
    static INSIDE: Cell<u64> = Cell::new(0);
}

/// A guard while the calling thread is inside an island of a robot. Each robot has one of 64 bits. Beyond 63 robots at once,
/// those that share the last bit get the error even where they could wait.
pub(super) struct Inside {
    before: u64,
}

impl Inside {
    #[inline]
    fn new(bit: u64) -> Self {
        INSIDE.with(|inside| {
            let before = inside.get();
            inside.set(before | bit);
            Self { before }
        })
    }

    pub(super) fn is_here(bit: u64) -> bool {
        INSIDE.with(|inside| inside.get() & bit != 0)
    }
}

impl Drop for Inside {
    #[inline]
    fn drop(&mut self) {
        INSIDE.with(|inside| inside.set(self.before));
    }
}

/// An island that the calling thread holds, by the guard `G`.
pub(super) struct Within<G> {
    guard: G,
    _inside: Inside,
}

impl<G> fmt::Debug for Within<G> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Within")
    }
}

impl<G> Within<G> {
    #[inline]
    pub(super) fn new(guard: G, bit: u64) -> Self {
        Self { guard, _inside: Inside::new(bit) }
    }
}

impl<G: Deref> Deref for Within<G> {
    type Target = G::Target;
    #[inline]
    fn deref(&self) -> &G::Target {
        &self.guard
    }
}

impl<G: DerefMut> DerefMut for Within<G> {
    #[inline]
    fn deref_mut(&mut self) -> &mut G::Target {
        &mut self.guard
    }
}
