//! The bounds of a queue of messages, in number and in bytes: the same for subscribers and for estimators.

use crate::message::{Payload, Stamped};

/// The bounds of a queue.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    pub(crate) capacity: usize,
    pub(crate) bytes: usize,
}

/// The content of a queue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Held {
    pub(crate) messages: usize,
    /// The sum of their counted bytes.
    pub(crate) bytes: usize,
}

/// The bytes that a queue holds, unless it has a bound of its own: 64 MiB.
pub(super) const DEFAULT_BYTES: usize = 64 << 20;

/// Memory that a queue reserves in advance, in bytes; beyond it, memory is allocated when messages first need it.
const ROOM_IN_ADVANCE: usize = 1 << 20;

/// A message's own size up to which it does not count towards the bytes of a queue.
const UNCOUNTED_BYTES: usize = 1 << 10;

/// Returns whether messages of this payload count towards the bytes of a queue.
pub(crate) const fn is_counted<T: Payload>() -> bool {
    size_of::<Stamped<T>>() > UNCOUNTED_BYTES || !T::IS_INLINE
}

/// The bytes of a message that count towards the bound of a queue.
#[inline]
pub(crate) fn counted_bytes<T: Payload>(message: &Stamped<T>) -> usize {
    let own = const { if size_of::<Stamped<T>>() > UNCOUNTED_BYTES { size_of::<Stamped<T>>() } else { 0 } };
    if T::IS_INLINE { own } else { own.saturating_add(message.payload.heap_bytes()) }
}

impl Bound {
    /// Bound of a queue in front of an estimator.
    pub(crate) const fn of_estimator(capacity: usize) -> Self {
        Self { capacity, bytes: DEFAULT_BYTES }
    }

    /// Returns whether a message of `bytes` counted bytes fits. One always does, however large it is.
    #[inline]
    pub(crate) fn has_room(self, held: Held, bytes: usize) -> bool {
        let has_bytes = || held.bytes.checked_add(bytes).is_some_and(|sum| sum <= self.bytes);
        held.messages == 0 || held.messages < self.capacity && has_bytes()
    }

    /// The number of entries for which memory is reserved, so that adding them allocates nothing.
    pub(crate) fn in_advance<Entry>(self) -> usize {
        self.capacity.min(ROOM_IN_ADVANCE / size_of::<Entry>().max(1))
    }
}

impl Held {
    #[inline]
    pub(crate) fn add(&mut self, bytes: usize) {
        self.messages += 1;
        self.bytes += bytes;
    }

    #[inline]
    pub(crate) fn remove(&mut self, bytes: usize) {
        self.messages -= 1;
        self.bytes -= bytes;
    }
}
