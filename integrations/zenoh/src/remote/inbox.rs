//! Messages that wait for a sensor.

use super::wire::Attachment;
use crate::session::lock;
use bb_core::MonotonicTime;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Messages that wait; the oldest makes room for another, and shows as a gap in the numbers.
const CAPACITY: usize = 64;

/// Bytes of these messages, at most, unless one message alone is longer.
const MOST_BYTES: usize = 16 * 1024 * 1024;

/// A message as it came.
#[derive(Clone, Debug)]
pub(super) struct Arrived {
    /// Time of arrival, on the local clock.
    pub(super) arrival: MonotonicTime,
    /// Hash of its layout.
    pub(super) hash: String,
    /// Payload's name by the sender.
    pub(super) payload: String,
    /// `None` if it is malformed.
    pub(super) attachment: Option<Attachment>,
    pub(super) bytes: Vec<u8>,
}

/// A bounded queue between zenoh's thread and that of the sensor.
#[derive(Debug, Default)]
pub(super) struct Inbox {
    waiting: Mutex<VecDeque<Arrived>>,
    changed: Condvar,
}

impl Inbox {
    pub(super) fn put(&self, arrived: Arrived) {
        let mut waiting = lock(&self.waiting);
        let bytes = |waiting: &VecDeque<Arrived>| waiting.iter().map(|message| message.bytes.len()).sum::<usize>();
        while !waiting.is_empty()
            && (waiting.len() >= CAPACITY || bytes(&waiting) + arrived.bytes.len() > MOST_BYTES)
        {
            waiting.pop_front();
        }
        waiting.push_back(arrived);
        self.changed.notify_one();
    }

    /// The oldest message; waits for one until `timeout`.
    pub(super) fn take(&self, timeout: Duration) -> Option<Arrived> {
        let waited = self.changed.wait_timeout_while(lock(&self.waiting), timeout, |waiting| waiting.is_empty());
        waited.unwrap_or_else(PoisonError::into_inner).0.pop_front()
    }
}
