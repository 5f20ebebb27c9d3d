//! Identifies a robot to the threads that are inside its islands.

use std::sync::atomic::{AtomicU64, Ordering};

/// A robot's mark. The first 63 robots that live in a process at the same time have one bit each. Any further robots share the last
/// bit and are told apart by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mark {
    pub(super) bit: u64,
    pub(super) number: u64,
}

impl Mark {
    /// Whether other robots may have the same bit.
    #[inline]
    pub(super) fn is_shared(self) -> bool {
        self.bit == SHARED_BIT
    }
}

/// Owns a robot's mark until dropped.
#[derive(Debug)]
pub(super) struct RobotMark(Mark);

/// The bits in use. The shared bit is always set.
static TAKEN: AtomicU64 = AtomicU64::new(SHARED_BIT);
const SHARED_BIT: u64 = 1 << 63;

/// The number of the next robot.
static NEXT: AtomicU64 = AtomicU64::new(0);

impl RobotMark {
    pub(super) fn take() -> Self {
        let free = |taken: u64| !taken & taken.wrapping_add(1);
        let before = TAKEN.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |taken| match free(taken) {
            0 => None,
            free => Some(taken | free),
        });
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        Self(Mark { bit: before.map_or(SHARED_BIT, free), number })
    }

    #[inline]
    pub(super) fn mark(&self) -> Mark {
        self.0
    }
}

impl Drop for RobotMark {
    fn drop(&mut self) {
        if !self.0.is_shared() {
            TAKEN.fetch_and(!self.0.bit, Ordering::Relaxed);
        }
    }
}
