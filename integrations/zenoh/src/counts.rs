//! Numbers of messages and requests.

use bb_core::Payload;
use std::sync::atomic::{AtomicU64, Ordering};

/// Numbers of messages and requests since the start of a [`Ros2Bridge`](crate::Ros2Bridge), published when they have changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct Ros2State {
    /// Messages put to other nodes.
    pub published: u64,
    /// Messages of the robot, and changes of parameters, that were not put: the bridge was too slow, or zenoh refused them.
    pub unpublished: u64,
    /// Messages of other nodes that the robot took.
    pub received: u64,
    /// Messages of other nodes that it did not take: of another type, not to be read, or faster than it takes them.
    pub refused: u64,
    /// Requests to services that were carried out or denied with a reason; not those that cannot be read, or for which there was no room.
    pub requests: u64,
}

/// Occurrences of one fault, which would fill the log if each was a line of it.
#[derive(Debug, Default)]
pub(crate) struct Repetitions(AtomicU64);

impl Repetitions {
    /// Counts one more, and returns the number if it is to be logged: that of the first, and then each that is twice the one before.
    pub(crate) fn add(&self) -> Option<u64> {
        Some(self.0.fetch_add(1, Ordering::Relaxed) + 1).filter(|times| times.is_power_of_two())
    }
}

/// The counters of a bridge.
#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) published: AtomicU64,
    pub(crate) unpublished: AtomicU64,
    pub(crate) received: AtomicU64,
    pub(crate) refused: AtomicU64,
    pub(crate) requests: AtomicU64,
    /// Messages that zenoh has refused.
    pub(crate) not_put: Repetitions,
}

impl Counts {
    pub(crate) fn add(counter: &AtomicU64, number: u64) {
        counter.fetch_add(number, Ordering::Relaxed);
    }

    pub(crate) fn state(&self) -> Ros2State {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Ros2State {
            published: read(&self.published),
            unpublished: read(&self.unpublished),
            received: read(&self.received),
            refused: read(&self.refused),
            requests: read(&self.requests),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_logged_at_first_and_then_by_doubling() {
        let refused = Repetitions::default();
        let logged: Vec<u64> = (0..1000).filter_map(|_| refused.add()).collect();
        assert_eq!(logged, [1, 2, 4, 8, 16, 32, 64, 128, 256, 512]);
    }
}
