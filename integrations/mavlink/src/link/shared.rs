//! The state shared by the users of a link and its thread.

use super::inbox::Inbox;
use super::{LinkError, LinkStatistics, Peer};
use crate::Address;
use crate::frames::Item;
use crate::transport::Writer;
use bb_core::MonotonicTime;
use bb_core::time::Clock;
use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, MavMessage};
use mavlink::{MAVLinkV2MessageRaw, MavHeader, Message, MessageData};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Identity of a sender: system, component, and the number of its next frame.
#[derive(Debug)]
pub(crate) struct Identity {
    system_id: u8,
    component_id: u8,
    sequence: Arc<AtomicU8>,
}

/// The default sender: the onboard computer of the first vehicle.
const DEFAULT_IDENTITY: (u8, u8) = (1, 191);

#[derive(Debug)]
pub(crate) struct Shared {
    address: Address,
    clock: Clock,
    is_stopping: AtomicBool,
    state: Mutex<State>,
    /// `None` once the link has failed.
    writer: Mutex<Option<Writer>>,
    identities: Mutex<Vec<Weak<Identity>>>,
    /// Used when there is no other sender; a sender that chooses its ids continues its numbering.
    default_identity: Arc<Identity>,
}

#[derive(Debug, Default)]
struct State {
    inboxes: Vec<Weak<Inbox>>,
    statistics: LinkStatistics,
    /// Peers by system and component.
    peers: BTreeMap<(u8, u8), PeerState>,
    failure: Option<LinkError>,
}

#[derive(Clone, Copy, Debug)]
struct PeerState {
    sequence: u8,
    heartbeat: Option<MonotonicTime>,
}

impl Shared {
    pub(super) fn new(address: Address, writer: Writer) -> Self {
        Self {
            address,
            clock: Clock::real(),
            is_stopping: AtomicBool::new(false),
            state: Mutex::default(),
            writer: Mutex::new(Some(writer)),
            identities: Mutex::default(),
            default_identity: Arc::new(Identity::new(DEFAULT_IDENTITY, Arc::default())),
        }
    }

    pub(super) fn address(&self) -> &Address {
        &self.address
    }

    pub(super) fn clock(&self) -> &Clock {
        &self.clock
    }

    pub(super) fn stop(&self) {
        self.is_stopping.store(true, Ordering::Release);
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.is_stopping.load(Ordering::Acquire)
    }

    pub(super) fn listen(&self, peer: Peer, ids: &[u32], capacity: usize) -> Arc<Inbox> {
        let inbox = Arc::new(Inbox::new(peer, ids, capacity));
        let mut state = self.state();
        state.inboxes.retain(|inbox| inbox.strong_count() > 0);
        state.inboxes.push(Arc::downgrade(&inbox));
        if let Some(failure) = &state.failure {
            inbox.fail(failure.clone());
        }
        inbox
    }

    /// The identity with these ids, which users share.
    pub(super) fn identity(&self, ids: (u8, u8)) -> Arc<Identity> {
        let mut identities = self.identities.lock().unwrap_or_else(PoisonError::into_inner);
        identities.retain(|identity| identity.strong_count() > 0);
        if let Some(identity) = identities.iter().filter_map(Weak::upgrade).find(|identity| identity.ids() == ids) {
            return identity;
        }
        let is_default = ids == DEFAULT_IDENTITY;
        let sequence = if is_default { Arc::clone(&self.default_identity.sequence) } else { Arc::default() };
        let identity = Arc::new(Identity::new(ids, sequence));
        identities.push(Arc::downgrade(&identity));
        identity
    }

    fn living(&self) -> Vec<Arc<Identity>> {
        let identities = self.identities.lock().unwrap_or_else(PoisonError::into_inner);
        identities.iter().filter_map(Weak::upgrade).collect()
    }

    /// All identities that send heartbeats: at least one, so that the peer learns of us.
    pub(super) fn identities(&self) -> Vec<Arc<Identity>> {
        let living = self.living();
        if living.is_empty() { vec![Arc::clone(&self.default_identity)] } else { living }
    }

    /// Sends a message. Returns `false` if no receiver is known.
    pub(super) fn send(&self, identity: &Identity, message: &MavMessage) -> Result<bool, LinkError> {
        let mut writer = self.writer.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(open) = writer.as_mut() else { return Err(self.failure()) };
        let mut frame = MAVLinkV2MessageRaw::new();
        frame.serialize_message(identity.header(), message);
        let sent = open.write(frame.raw_bytes());
        drop(writer);
        let mut state = self.state();
        match &sent {
            Ok(true) => state.statistics.sent += 1,
            Ok(false) | Err(_) => state.statistics.unsent += 1,
        }
        sent.map_err(|error| LinkError::Failed { address: self.address.clone(), source: Arc::new(error) })
    }

    /// Delivers a message to the inboxes. Returns whether its sender becomes the peer: if a driver listens to it, or there is no
    /// driver.
    pub(super) fn deliver(&self, item: Item, arrival: MonotonicTime) -> bool {
        let mut state = self.state();
        match item {
            Item::Message(header, message) => {
                state.statistics.messages += 1;
                let id = message.message_id();
                let peer = state.received(header);
                if id == HEARTBEAT_DATA::ID {
                    peer.heartbeat = Some(arrival);
                }
                let inboxes: Vec<_> = state.inboxes.iter().filter_map(Weak::upgrade).collect();
                let dropped = inboxes.iter().filter(|inbox| inbox.offer(header, id, &message, arrival)).count();
                state.statistics.dropped += dropped as u64;
                inboxes.is_empty() || inboxes.iter().any(|inbox| inbox.hears(header))
            }
            Item::Unknown(header) => {
                state.statistics.unknown += 1;
                state.received(header);
                false
            }
            Item::Invalid(header) => {
                state.statistics.invalid += 1;
                state.received(header);
                false
            }
        }
    }

    pub(super) fn count_skipped(&self, bytes: u64) {
        self.state().statistics.bytes_skipped = bytes;
    }

    /// Returns the time of a peer's last heartbeat.
    pub(super) fn last_heartbeat(&self, peer: Peer) -> Option<MonotonicTime> {
        let state = self.state();
        let of_peer = state.peers.iter().filter(|((system_id, component_id), _)| {
            peer.is(MavHeader { system_id: *system_id, component_id: *component_id, sequence: 0 })
        });
        of_peer.filter_map(|(_, peer)| peer.heartbeat).max()
    }

    pub(super) fn statistics(&self) -> LinkStatistics {
        self.state().statistics
    }

    pub(super) fn fail(&self, failure: LinkError) {
        // Both ends are closed before users learn of it, since they may then open the device again.
        *self.writer.lock().unwrap_or_else(PoisonError::into_inner) = None;
        let mut state = self.state();
        for inbox in state.inboxes.iter().filter_map(Weak::upgrade) {
            inbox.fail(failure.clone());
        }
        state.failure = Some(failure);
    }

    pub(super) fn check(&self) -> Result<(), LinkError> {
        self.state().failure.clone().map_or(Ok(()), Err)
    }

    pub(super) fn has_failed(&self) -> bool {
        self.state().failure.is_some()
    }

    fn failure(&self) -> LinkError {
        let closed = || LinkError::Failed {
            address: self.address.clone(),
            source: Arc::new(std::io::Error::other("it is closed")),
        };
        self.state().failure.clone().unwrap_or_else(closed)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Counts frames lost before this one.
    fn received(&mut self, header: MavHeader) -> &mut PeerState {
        let MavHeader { system_id, component_id, sequence } = header;
        let peer = self
            .peers
            .entry((system_id, component_id))
            .or_insert(PeerState { sequence: sequence.wrapping_sub(1), heartbeat: None });
        let lost = sequence.wrapping_sub(peer.sequence).wrapping_sub(1);
        // A difference of more than half the range is more likely a frame that was overtaken or sent twice, or a
        // sender that restarted.
        if lost < 128 {
            self.statistics.lost += u64::from(lost);
        }
        peer.sequence = sequence;
        peer
    }
}

impl Identity {
    fn new((system_id, component_id): (u8, u8), sequence: Arc<AtomicU8>) -> Self {
        Self { system_id, component_id, sequence }
    }

    fn ids(&self) -> (u8, u8) {
        (self.system_id, self.component_id)
    }

    pub(super) fn header(&self) -> MavHeader {
        let (system_id, component_id) = self.ids();
        MavHeader { system_id, component_id, sequence: self.sequence.fetch_add(1, Ordering::Relaxed) }
    }
}
