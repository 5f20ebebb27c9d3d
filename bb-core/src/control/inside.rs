//! Whether the calling thread runs code that disarming waits for, and which must not wait for that in turn.

use std::cell::Cell;

thread_local! {
    /// Of which robot the calling thread runs a disarm callback; 0 for none.
    static CALLBACK: Cell<usize> = const { Cell::new(0) };
    /// Of which robot the calling thread runs an actuator's code, which its disarm callback waits for; 0 for none.
    static ACTUATOR: Cell<usize> = const { Cell::new(0) };
}

/// Runs a disarm callback of `robot`.
pub(super) fn callback<T>(robot: usize, code: impl FnOnce() -> T) -> T {
    let before = CALLBACK.replace(robot);
    let result = code();
    CALLBACK.set(before);
    result
}

/// Whether the calling thread runs a disarm callback of `robot`.
pub(super) fn is_callback(robot: usize) -> bool {
    CALLBACK.get() == robot
}

/// Whether the calling thread runs code of `robot` that disarming waits for.
pub(super) fn is_waited_for(robot: usize) -> bool {
    is_callback(robot) || ACTUATOR.get() == robot
}

/// The calling thread runs an actuator's code as long as this lives.
pub(crate) struct InActuator {
    before: usize,
}

impl InActuator {
    pub(super) fn new(robot: usize) -> Self {
        Self { before: ACTUATOR.replace(robot) }
    }
}

impl Drop for InActuator {
    fn drop(&mut self) {
        ACTUATOR.set(self.before);
    }
}
