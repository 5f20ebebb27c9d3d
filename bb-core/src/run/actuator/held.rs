//! Which actuators the calling thread is inside: their code must not wait for themselves.

use std::cell::RefCell;

thread_local! {
    static HELD: RefCell<Vec<usize>> = const { RefCell::new(Vec::new()) };
}

/// The calling thread is inside an actuator as long as this lives.
pub(super) struct Held;

impl Held {
    /// None if it is inside already. Actuators are known by their addresses.
    pub(super) fn new(actuator: usize) -> Option<Self> {
        HELD.with_borrow_mut(|held| {
            if held.contains(&actuator) {
                return None;
            }
            held.push(actuator);
            Some(Self)
        })
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // They are dropped in the opposite order.
        HELD.with_borrow_mut(|held| {
            held.pop();
        });
    }
}
