//! One connection, shared by all users of its address.
//!
//! A thread reads it until the last user drops it: reads wait for 50 ms at most, so the thread ends soon after. Every
//! user has its own inbox of a bounded number of messages. A slow user loses the oldest, which is counted, and does
//! not delay others.

mod inbox;
mod reading;
mod shared;

pub(crate) use inbox::{Inbox, Received};
pub(crate) use shared::Identity;

use crate::transport;
use crate::{Address, AddressError};
use bb_core::{MonotonicTime, Payload};
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::MavMessage;
use shared::Shared;
use std::collections::HashMap;
use std::io;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

/// Reason for which a link cannot be opened, or can no longer be used.
#[derive(Clone, Debug, thiserror::Error)]
pub enum LinkError {
    /// The address is malformed.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// Failure to open the link: the port is taken, or the device does not exist.
    #[error("the link `{address}` cannot be opened: {source}")]
    Open {
        /// The address of the link.
        address: Address,
        /// Cause of the failure.
        source: Arc<io::Error>,
    },
    /// Failure of an open link: the device was unplugged.
    #[error("the link `{address}` has failed: {source}")]
    Failed {
        /// The address of the link.
        address: Address,
        /// Cause of the failure.
        source: Arc<io::Error>,
    },
}

/// Counts of a link since it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Payload)]
pub struct LinkStatistics {
    /// Messages of the dialect `ardupilotmega`, which includes `common`.
    pub messages: u64,
    /// Frames of other dialects.
    pub unknown: u64,
    /// Frames with a good checksum and a content that is not in the dialect.
    pub invalid: u64,
    /// Bytes that belong to no frame: noise, and frames with a bad checksum.
    pub bytes_skipped: u64,
    /// Messages that drivers lost because they came faster than they were read.
    pub dropped: u64,
    /// Frames missing from the senders' numbering.
    pub lost: u64,
    /// Frames sent.
    pub sent: u64,
    /// Frames that could not be sent, or had no known receiver.
    pub unsent: u64,
}

/// The peer to listen to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Peer {
    /// 0 for any.
    pub(crate) system_id: u8,
    /// 0 for any.
    pub(crate) component_id: u8,
}

impl Peer {
    fn is(self, header: MavHeader) -> bool {
        let fits = |wanted: u8, is: u8| wanted == 0 || wanted == is;
        fits(self.system_id, header.system_id) && fits(self.component_id, header.component_id)
    }
}

/// A user's handle of a connection. Dropping the last one closes it.
#[derive(Debug)]
pub(crate) struct Link {
    shared: Arc<Shared>,
}

/// A connection with its thread.
struct Open {
    shared: Arc<Shared>,
    thread: JoinHandle<()>,
    users: usize,
}

/// All open connections. Locked while one is opened or closed, so that no address is opened twice.
static LINKS: LazyLock<Mutex<HashMap<Address, Open>>> = LazyLock::new(Mutex::default);

fn links() -> MutexGuard<'static, HashMap<Address, Open>> {
    LINKS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Link {
    /// Opens a connection, or shares the one that is open.
    ///
    /// # Errors
    /// The address is malformed, or it cannot be opened.
    pub(crate) fn open(address: &str) -> Result<Self, LinkError> {
        let address: Address = address.parse()?;
        let mut links = links();
        // A failed one is left to its remaining users.
        if let Some(open) = links.get_mut(&address).filter(|open| !open.shared.has_failed()) {
            open.users += 1;
            return Ok(Self { shared: Arc::clone(&open.shared) });
        }
        let failed = |source: io::Error| LinkError::Open { address: address.clone(), source: Arc::new(source) };
        let (reader, writer) = transport::open(&address).map_err(failed)?;
        let shared = Arc::new(Shared::new(address.clone(), writer));
        let of_thread = Arc::clone(&shared);
        let named = thread::Builder::new().name("mavlink".into());
        let thread = named.spawn(move || reading::read(&of_thread, reader)).map_err(failed)?;
        links.insert(address, Open { shared: Arc::clone(&shared), thread, users: 1 });
        Ok(Self { shared })
    }

    /// Listens to messages of a peer with these ids.
    pub(crate) fn listen(&self, peer: Peer, ids: &[u32], capacity: usize) -> Arc<Inbox> {
        self.shared.listen(peer, ids, capacity)
    }

    /// Registers a sender with these ids, which sends heartbeats until the identity is dropped.
    pub(crate) fn identity(&self, system_id: u8, component_id: u8) -> Arc<Identity> {
        self.shared.identity((system_id, component_id))
    }

    /// Sends a message. Returns `false` if no receiver is known.
    ///
    /// Checks that the link works.
    ///
    /// # Errors
    /// The link has failed.
    pub(crate) fn send(&self, identity: &Identity, message: &MavMessage) -> Result<bool, LinkError> {
        self.shared.send(identity, message)
    }

    /// Checks that the link works.
    ///
    /// # Errors
    /// The link has failed.
    pub(crate) fn check(&self) -> Result<(), LinkError> {
        self.shared.check()
    }

    /// Returns the time of a peer's last heartbeat, on the machine's clock.
    pub(crate) fn last_heartbeat(&self, peer: Peer) -> Option<MonotonicTime> {
        self.shared.last_heartbeat(peer)
    }

    /// The machine's time.
    pub(crate) fn now(&self) -> MonotonicTime {
        self.shared.clock().now()
    }

    pub(crate) fn statistics(&self) -> LinkStatistics {
        self.shared.statistics()
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let mut links = links();
        let address = self.shared.address();
        // A failed link may have a successor at its address; its thread has ended.
        let Some(open) = links.get_mut(address).filter(|open| Arc::ptr_eq(&open.shared, &self.shared)) else {
            return;
        };
        open.users -= 1;
        if open.users > 0 {
            return;
        }
        let Some(open) = links.remove(address) else { return };
        open.shared.stop();
        // It ends after its current read. Until then, the address stays taken.
        let _ = open.thread.join();
    }
}

#[cfg(test)]
mod tests;
