//! Whether the calling thread runs code that disarming waits for. Such code must not wait for the disarming in turn.

use std::cell::RefCell;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Pairs of robots of this process: code that the first one's disarming waits for is waiting for the second one to be
/// disarmed.
static WAITS: Mutex<Vec<(usize, usize)>> = Mutex::new(Vec::new());

thread_local! {
    /// Code that the calling thread is inside of: of one robot, and called from there perhaps of another.
    static INSIDE: RefCell<Vec<(usize, Code)>> = const { RefCell::new(Vec::new()) };
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Code {
    /// A disarm callback.
    Callback,
    /// An actuator's code, which its disarm callback waits for.
    Actuator,
}

/// Runs a disarm callback of `robot`.
pub(super) fn callback<T>(robot: usize, code: impl FnOnce() -> T) -> T {
    let _inside = Inside::new(robot, Code::Callback);
    code()
}

/// Whether the calling thread runs a disarm callback of `robot`.
pub(super) fn is_callback(robot: usize) -> bool {
    INSIDE.with_borrow(|inside| inside.contains(&(robot, Code::Callback)))
}

/// Whether the calling thread runs code of `robot` that disarming waits for.
pub(super) fn is_waited_for(robot: usize) -> bool {
    INSIDE.with_borrow(|inside| inside.iter().any(|(other, _)| *other == robot))
}

/// The calling thread waits for a robot to be disarmed until this is dropped.
#[derive(Debug)]
pub(super) struct Waits(Vec<(usize, usize)>);

/// Called before the calling thread waits for `robot` to be disarmed. Returns `None` if the wait would deadlock: the
/// thread runs code that the disarming of `robot` waits for, directly or because code of `robot` waits for another
/// robot.
pub(super) fn waits_for(robot: usize) -> Option<Waits> {
    let inside: Vec<usize> = INSIDE.with_borrow(|inside| inside.iter().map(|(robot, _)| *robot).collect());
    if inside.is_empty() {
        return Some(Waits(Vec::new()));
    }
    let mut waits = all_waits();
    let mut reached = vec![robot];
    let mut next = 0;
    while let Some(&from) = reached.get(next) {
        next += 1;
        let new: Vec<usize> = waits.iter().filter(|(other, _)| *other == from).map(|(_, to)| *to).collect();
        reached.extend(new.into_iter().filter(|to| !reached.contains(to)).collect::<Vec<_>>());
    }
    if inside.iter().any(|robot| reached.contains(robot)) {
        return None;
    }
    let own: Vec<_> = inside.into_iter().map(|from| (from, robot)).collect();
    waits.extend(&own);
    Some(Waits(own))
}

impl Drop for Waits {
    fn drop(&mut self) {
        if self.0.is_empty() {
            return;
        }
        let mut waits = all_waits();
        for wait in &self.0 {
            if let Some(index) = waits.iter().position(|other| other == wait) {
                waits.swap_remove(index);
            }
        }
    }
}

fn all_waits() -> MutexGuard<'static, Vec<(usize, usize)>> {
    WAITS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The calling thread is inside until this is dropped. Guards are dropped in the reverse order.
struct Inside;

impl Inside {
    fn new(robot: usize, code: Code) -> Self {
        INSIDE.with_borrow_mut(|inside| inside.push((robot, code)));
        Self
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        INSIDE.with_borrow_mut(|inside| inside.pop());
    }
}

/// The calling thread runs an actuator's code until this is dropped.
pub(crate) struct InActuator {
    _inside: Inside,
}

impl InActuator {
    pub(super) fn new(robot: usize) -> Self {
        Self { _inside: Inside::new(robot, Code::Actuator) }
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;

    /// Numbers that no robot of another test has.
    const A: usize = usize::MAX;
    const B: usize = usize::MAX - 2;
    const C: usize = usize::MAX - 4;

    #[test]
    fn a_thread_inside_no_robot_waits_for_any() {
        assert!(waits_for(A).is_some());
    }

    #[test]
    fn whoever_closes_a_circle_is_told() {
        let _a_for_b = callback(A, || waits_for(B)).expect("no circle yet");
        assert!(callback(A, || waits_for(A)).is_none(), "its own");
        assert!(callback(B, || waits_for(A)).is_none(), "a circle of two");
        let b_for_c = callback(B, || waits_for(C)).expect("no circle yet");
        assert!(callback(C, || waits_for(A)).is_none(), "a circle of three");
        assert!(callback(A, || waits_for(C)).is_some(), "two ways, and no circle");
        drop(b_for_c);
        assert!(callback(C, || waits_for(A)).is_some(), "the circle is broken");
    }

    #[test]
    fn code_inside_two_robots_waits_for_neither() {
        const D: usize = usize::MAX - 6;
        const E: usize = usize::MAX - 8;
        let told = callback(D, || callback(E, || (waits_for(D).is_none(), waits_for(E).is_none())));
        assert_eq!(told, (true, true));
    }
}
