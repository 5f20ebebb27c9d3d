//! The robots whose islands a thread is inside. Code running there must not wait for an island of the same robot.

use crate::node::mark::Mark;
use std::cell::{Cell, RefCell};
use std::fmt;
use std::ops::{Deref, DerefMut};

#[cfg(not(loom))]
thread_local! {
    static INSIDE: Cell<u64> = const { Cell::new(0) };
    /// The numbers of the robots that share a bit.
    static SHARING: RefCell<Vec<u64>> = const { RefCell::new(Vec::new()) };
}
#[cfg(loom)]
loom::thread_local! {
    static INSIDE: Cell<u64> = Cell::new(0);
    static SHARING: RefCell<Vec<u64>> = RefCell::new(Vec::new());
}

/// A guard held while the calling thread is inside an island of a robot.
pub(super) struct Inside {
    before: u64,
    is_shared: bool,
}

impl Inside {
    #[inline]
    fn new(mark: Mark) -> Self {
        let is_shared = mark.is_shared();
        if is_shared {
            share(mark);
        }
        INSIDE.with(|inside| {
            let before = inside.get();
            inside.set(before | mark.bit);
            Self { before, is_shared }
        })
    }

    pub(super) fn is_here(mark: Mark) -> bool {
        let has_bit = INSIDE.with(|inside| inside.get() & mark.bit != 0);
        has_bit && (!mark.is_shared() || SHARING.with(|sharing| sharing.borrow().contains(&mark.number)))
    }
}

impl Drop for Inside {
    #[inline]
    fn drop(&mut self) {
        INSIDE.with(|inside| inside.set(self.before));
        if self.is_shared {
            cease_to_share();
        }
    }
}

#[cold]
fn share(mark: Mark) {
    SHARING.with(|sharing| sharing.borrow_mut().push(mark.number));
}

/// For the island that was entered last: a thread leaves islands in reverse order.
#[cold]
fn cease_to_share() {
    SHARING.with(|sharing| sharing.borrow_mut().pop());
}

/// An island that the calling thread holds through the guard `G`.
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
    pub(super) fn new(guard: G, mark: Mark) -> Self {
        Self { guard, _inside: Inside::new(mark) }
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

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::node::mark::RobotMark;

    #[test]
    fn a_thread_knows_which_of_many_robots_it_is_inside() {
        let robots: Vec<_> = std::iter::repeat_with(RobotMark::take).take(200).collect();
        assert!(robots.iter().filter(|robot| robot.mark().is_shared()).count() > 100);
        let is_inside = |robot: &RobotMark| Inside::is_here(robot.mark());
        let mut within = Vec::new();
        for (entered, robot) in robots.iter().enumerate() {
            assert!(robots[..entered].iter().all(is_inside) && !robots[entered..].iter().any(is_inside));
            within.push(Within::new(&(), robot.mark()));
        }
        while within.pop().is_some() {
            let entered = within.len();
            assert!(robots[..entered].iter().all(is_inside) && !robots[entered..].iter().any(is_inside));
        }
    }
}
