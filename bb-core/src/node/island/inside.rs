//! Which threads are inside an island: code that they call there must not wait for one.

use std::cell::Cell;
use std::fmt;
use std::ops::{Deref, DerefMut};
use std::time::Duration;

#[cfg(not(loom))]
thread_local! {
    static DEPTH: Cell<usize> = const { Cell::new(0) };
}
#[cfg(loom)]
loom::thread_local! {
    static DEPTH: Cell<usize> = Cell::new(0);
}

/// The calling thread is inside an island as long as this lives.
pub(super) struct Inside(());

impl Inside {
    #[inline]
    fn new() -> Self {
        DEPTH.with(|depth| depth.set(depth.get() + 1));
        Self(())
    }

    pub(super) fn is_here() -> bool {
        DEPTH.with(|depth| depth.get() > 0)
    }
}

impl Drop for Inside {
    #[inline]
    fn drop(&mut self) {
        DEPTH.with(|depth| depth.set(depth.get() - 1));
    }
}

/// An island that the calling thread holds, by the guard `G`.
pub struct Within<G> {
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
    pub(super) fn new(guard: G) -> Self {
        Self { guard, _inside: Inside::new() }
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

/// Waits until `holds`, `longest` at most; whether it does.
#[cfg(not(loom))]
pub(super) fn until(longest: Duration, holds: impl Fn() -> bool) -> bool {
    let start = std::time::Instant::now();
    loop {
        if holds() {
            return true;
        }
        if start.elapsed() >= longest {
            return false;
        }
        std::thread::yield_now();
    }
}

/// A model has no time: others go on once.
#[cfg(loom)]
pub(super) fn until(_: Duration, holds: impl Fn() -> bool) -> bool {
    loom::thread::yield_now();
    holds()
}
