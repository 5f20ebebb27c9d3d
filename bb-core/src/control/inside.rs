//! Code that others wait for, and what it waits for in turn: the disarming of a robot, or an actuator that another thread is inside
//! of. Where threads would wait for each other in a circle, the one that closes it gets an error instead.
//!
//! A thread registers its wait, under one lock, before it begins to wait and after it has entered the code that others wait for. The
//! last thread of a circle therefore sees the whole circle. Between actuators, no thread gets an error without a circle. A
//! wait for a robot counts all of its code, also an actuator that has been disarmed already.

use std::cell::RefCell;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Something that threads wait for: the disarming of a robot, or an actuator. The address of its state.
pub(crate) type Awaited = usize;

/// Pairs: code that the first one waits for is waiting for the second one.
static WAITS: Mutex<Vec<(Awaited, Awaited)>> = Mutex::new(Vec::new());

thread_local! {
    /// Code that the calling thread is inside of: of one robot, and called from there perhaps of another.
    static INSIDE: RefCell<Vec<Place>> = const { RefCell::new(Vec::new()) };
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    /// Its disarming waits for the code.
    robot: Awaited,
    code: Code,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Code {
    /// The disarm callback with that number.
    Callback(u64),
    /// The code of an actuator, which its disarm callback waits for.
    Actuator { actuator: Awaited, path: &'static str },
}

/// Runs a disarm callback of `robot`.
pub(super) fn callback<T>(robot: Awaited, number: u64, code: impl FnOnce() -> T) -> T {
    let _inside = Inside::new(Place { robot, code: Code::Callback(number) });
    code()
}

/// Whether the calling thread runs a disarm callback of `robot`.
pub(super) fn is_callback(robot: Awaited) -> bool {
    is_any(|place| place.robot == robot && matches!(place.code, Code::Callback(_)))
}

/// Whether the calling thread runs code of `robot` that disarming waits for.
pub(super) fn is_waited_for(robot: Awaited) -> bool {
    is_any(|place| place.robot == robot)
}

/// Whether a disarm callback of `robot` waits for code that the calling thread is inside of: the one with that number, or that of the
/// actuator at that path.
pub(super) fn is_callback_waiting(robot: Awaited, number: u64, of_actuator: Option<&'static str>) -> bool {
    let waits = |code: Code| match code {
        Code::Callback(other) => other == number,
        Code::Actuator { path, .. } => of_actuator == Some(path),
    };
    is_any(|place| place.robot == robot && waits(place.code))
}

/// Whether the calling thread is inside the actuator.
pub(crate) fn is_in_actuator(other: Awaited) -> bool {
    is_any(|place| matches!(place.code, Code::Actuator { actuator, .. } if actuator == other))
}

fn is_any(is: impl Fn(&Place) -> bool) -> bool {
    INSIDE.with_borrow(|inside| inside.iter().any(is))
}

/// The calling thread waits until this is dropped.
#[derive(Debug)]
pub(crate) struct Waits(Vec<(Awaited, Awaited)>);

/// Called before the calling thread waits for `awaited`. Returns `None` if the wait would deadlock: the thread runs code that `awaited`
/// waits for, directly or because other code that it waits for is waiting.
pub(crate) fn waits_for(awaited: Awaited) -> Option<Waits> {
    let inside: Vec<Awaited> = INSIDE.with_borrow(|inside| inside.iter().flat_map(Place::awaited).collect());
    if inside.is_empty() {
        return Some(Waits(Vec::new()));
    }
    let mut waits = all_waits();
    let mut reached = vec![awaited];
    let mut next = 0;
    while let Some(&from) = reached.get(next) {
        next += 1;
        let new: Vec<Awaited> = waits.iter().filter(|(other, _)| *other == from).map(|(_, to)| *to).collect();
        reached.extend(new.into_iter().filter(|to| !reached.contains(to)).collect::<Vec<_>>());
    }
    if inside.iter().any(|place| reached.contains(place)) {
        return None;
    }
    let own: Vec<_> = inside.into_iter().map(|from| (from, awaited)).collect();
    waits.extend(&own);
    Some(Waits(own))
}

impl Place {
    /// What waits for the code.
    fn awaited(&self) -> impl Iterator<Item = Awaited> {
        let actuator = match self.code {
            Code::Callback(_) => None,
            Code::Actuator { actuator, .. } => Some(actuator),
        };
        std::iter::once(self.robot).chain(actuator)
    }
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

fn all_waits() -> MutexGuard<'static, Vec<(Awaited, Awaited)>> {
    WAITS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The calling thread is inside until this is dropped.
struct Inside(Place);

impl Inside {
    fn new(place: Place) -> Self {
        INSIDE.with_borrow_mut(|inside| inside.push(place));
        Self(place)
    }
}

impl Drop for Inside {
    fn drop(&mut self) {
        INSIDE.with_borrow_mut(|inside| {
            if let Some(index) = inside.iter().rposition(|place| *place == self.0) {
                inside.remove(index);
            }
        });
    }
}

/// The calling thread runs an actuator's code until this is dropped.
pub(crate) struct InActuator {
    _inside: Inside,
}

impl InActuator {
    /// `robot` is [`Control::id`](super::Control::id).
    pub(crate) fn new(robot: Awaited, actuator: Awaited, path: &'static str) -> Self {
        Self { _inside: Inside::new(Place { robot, code: Code::Actuator { actuator, path } }) }
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
        let _a_for_b = callback(A, 0, || waits_for(B)).expect("no circle yet");
        assert!(callback(A, 0, || waits_for(A)).is_none(), "its own");
        assert!(callback(B, 0, || waits_for(A)).is_none(), "a circle of two");
        let b_for_c = callback(B, 0, || waits_for(C)).expect("no circle yet");
        assert!(callback(C, 0, || waits_for(A)).is_none(), "a circle of three");
        assert!(callback(A, 0, || waits_for(C)).is_some(), "two ways, and no circle");
        drop(b_for_c);
        assert!(callback(C, 0, || waits_for(A)).is_some(), "the circle is broken");
    }

    #[test]
    fn code_inside_two_robots_waits_for_neither() {
        const D: usize = usize::MAX - 6;
        const E: usize = usize::MAX - 8;
        let told = callback(D, 0, || callback(E, 0, || (waits_for(D).is_none(), waits_for(E).is_none())));
        assert_eq!(told, (true, true));
    }

    #[test]
    fn a_circle_through_an_actuator_is_seen_from_either_end() {
        const ROBOT: usize = usize::MAX - 10;
        const OTHER: usize = usize::MAX - 12;
        const ACTUATOR: usize = usize::MAX - 14;
        let in_actuator = || InActuator::new(OTHER, ACTUATOR, "actuator");
        // Code of the actuator waits for the robot, whose callback would wait for the actuator.
        let disarms = {
            let _inside = in_actuator();
            waits_for(ROBOT).expect("no circle yet")
        };
        assert!(callback(ROBOT, 0, || waits_for(ACTUATOR)).is_none());
        assert!(callback(ROBOT, 0, || waits_for(ACTUATOR - 2)).is_some(), "another actuator");
        drop(disarms);
        let sends = callback(ROBOT, 0, || waits_for(ACTUATOR)).expect("no circle");
        let _inside = in_actuator();
        assert!(is_in_actuator(ACTUATOR) && !is_in_actuator(OTHER));
        assert!(waits_for(ROBOT).is_none());
        drop(sends);
        assert!(waits_for(ROBOT).is_some(), "the circle is broken");
    }

    #[test]
    fn a_callback_waits_for_its_own_thread_or_for_that_inside_its_actuator() {
        let waiting = |number, of_actuator| is_callback_waiting(A, number, of_actuator);
        assert!(!waiting(3, Some("arm")));
        callback(A, 3, || assert!(waiting(3, None) && !waiting(4, Some("arm"))));
        let _inside = InActuator::new(A, B, "arm");
        assert!(waiting(4, Some("arm")) && !waiting(4, Some("leg")) && !waiting(4, None));
        assert!(!is_callback_waiting(B, 4, Some("arm")), "of another robot");
    }
}
