//! Messages waiting for one user of a link.

use crate::link::{LinkError, Peer};
use bb_core::MonotonicTime;
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::MavMessage;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A message, and its arrival time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Received {
    pub(crate) message: MavMessage,
    /// Time of arrival, on the machine's clock.
    pub(crate) arrival: MonotonicTime,
}

/// The newest messages with certain ids from one peer, bounded in number.
#[derive(Debug)]
pub(crate) struct Inbox {
    peer: Peer,
    ids: Vec<u32>,
    capacity: usize,
    waiting: Mutex<Waiting>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    messages: VecDeque<Received>,
    dropped: u64,
    failure: Option<LinkError>,
}

impl Inbox {
    pub(super) fn new(peer: Peer, ids: &[u32], capacity: usize) -> Self {
        let waiting = Waiting { messages: VecDeque::with_capacity(capacity), ..Waiting::default() };
        Self { peer, ids: ids.to_vec(), capacity, waiting: Mutex::new(waiting), changed: Condvar::new() }
    }

    /// Returns whether it listens to that sender.
    pub(super) fn hears(&self, header: MavHeader) -> bool {
        self.peer.is(header)
    }

    /// Adds a copy of a message if it is wanted. Returns whether the oldest had to be dropped for it.
    pub(super) fn offer(&self, header: MavHeader, id: u32, message: &MavMessage, arrival: MonotonicTime) -> bool {
        if !self.ids.contains(&id) || !self.peer.is(header) {
            return false;
        }
        let mut waiting = self.lock();
        let is_full = waiting.messages.len() >= self.capacity;
        if is_full {
            waiting.messages.pop_front();
            waiting.dropped += 1;
        }
        waiting.messages.push_back(Received { message: message.clone(), arrival });
        self.changed.notify_one();
        is_full
    }

    /// The link has failed: nothing more will come.
    pub(super) fn fail(&self, failure: LinkError) {
        self.lock().failure = Some(failure);
        self.changed.notify_all();
    }

    /// The oldest message; waits for one until `timeout`.
    ///
    /// # Errors
    /// The link has failed. Earlier messages are returned first.
    pub(crate) fn receive(&self, timeout: Duration) -> Result<Option<Received>, LinkError> {
        let deadline = Instant::now() + timeout;
        let mut waiting = self.lock();
        loop {
            if let Some(message) = waiting.messages.pop_front() {
                return Ok(Some(message));
            }
            if let Some(failure) = &waiting.failure {
                return Err(failure.clone());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(None);
            }
            waiting = self.changed.wait_timeout(waiting, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Returns the number of messages that were lost because this user was slow.
    pub(crate) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
