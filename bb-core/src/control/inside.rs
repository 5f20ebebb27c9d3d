//! Whether the calling thread runs code that disarming waits for, and which must not wait for that in turn.

use std::cell::RefCell;

thread_local! {
    /// What the calling thread is inside of: of one robot, and from there perhaps of another.
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

/// The calling thread is inside as long as this lives. They end in the reverse order.
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

/// The calling thread runs an actuator's code as long as this lives.
pub(crate) struct InActuator {
    _inside: Inside,
}

impl InActuator {
    pub(super) fn new(robot: usize) -> Self {
        Self { _inside: Inside::new(robot, Code::Actuator) }
    }
}
