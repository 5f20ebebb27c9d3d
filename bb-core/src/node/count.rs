//! A count that can be read while it is written.

use std::sync::atomic::{AtomicU64, Ordering};

/// A count with one writer at a time (the thread that holds its estimator) and any number of readers.
///
/// A plain load and store suffice instead of an atomic addition: the writers already exclude each other.
#[derive(Debug, Default)]
pub(crate) struct Count(AtomicU64);

impl Count {
    /// Adds one; returns the new count.
    #[inline]
    pub(crate) fn increment(&self) -> u64 {
        let count = self.0.load(Ordering::Relaxed).wrapping_add(1);
        self.0.store(count, Ordering::Relaxed);
        count
    }

    pub(super) fn set(&self, value: u64) {
        self.0.store(value, Ordering::Relaxed);
    }

    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}
