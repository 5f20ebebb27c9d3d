//! The robots whose islands a thread is inside. Code running there must not wait for an island of the same robot.

use crate::node::environment::RobotId;
use std::cell::RefCell;
use std::ops::{Deref, DerefMut};

#[cfg(not(loom))]
thread_local! {
    static INSIDE: RefCell<Vec<RobotId>> = const { RefCell::new(Vec::new()) };
}
#[cfg(loom)]
loom::thread_local! {
    static INSIDE: RefCell<Vec<RobotId>> = RefCell::new(Vec::new());
}

/// Returns whether the calling thread is inside an island of that robot.
pub(super) fn is_inside(robot: RobotId) -> bool {
    with(|inside| inside.contains(&robot)).unwrap_or(false)
}

/// `None` in a thread that ends: values that it drops may still publish.
fn with<T>(call: impl FnOnce(&mut Vec<RobotId>) -> T) -> Option<T> {
    #[cfg(not(loom))]
    return INSIDE.try_with(|inside| call(&mut inside.borrow_mut())).ok();
    #[cfg(loom)]
    return Some(INSIDE.with(|inside| call(&mut inside.borrow_mut())));
}

/// An island of a robot that the calling thread holds through the guard `G`. A thread leaves islands in reverse order.
pub(super) struct Within<G> {
    guard: G,
    _inside: Inside,
}

struct Inside;

impl Drop for Inside {
    #[inline]
    fn drop(&mut self) {
        with(Vec::pop);
    }
}

impl<G> Within<G> {
    #[inline]
    pub(super) fn new(guard: G, robot: RobotId) -> Self {
        with(|inside| inside.push(robot));
        Self { guard, _inside: Inside }
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

    #[test]
    fn a_thread_knows_which_of_many_robots_it_is_inside() {
        let mut within = Vec::new();
        for robot in 0..200 {
            assert!((0..robot).all(|other| is_inside(RobotId(other))) && !is_inside(RobotId(robot)));
            within.push(Within::new(&(), RobotId(robot)));
        }
        while within.pop().is_some() {
            let entered = within.len();
            assert!((0..entered).all(|other| is_inside(RobotId(other))) && !is_inside(RobotId(entered)));
        }
    }
}
