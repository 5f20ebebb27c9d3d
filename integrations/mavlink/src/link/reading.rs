//! The thread that reads a link, distributes messages, and sends heartbeats.

use super::LinkError;
use super::shared::Shared;
use crate::frames::{Framer, Item, begins_with_message};
use crate::transport::{LONGEST_READ, Reader};
use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavState, MavType};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The period of heartbeats.
const HEARTBEAT: Duration = Duration::from_secs(1);

pub(super) fn read(shared: &Shared, mut reader: Reader) {
    let mut buffer = vec![0; LONGEST_READ];
    let mut framer = Framer::default();
    let mut next_heartbeat = Instant::now();
    while !shared.is_stopping() {
        if Instant::now() >= next_heartbeat {
            next_heartbeat = Instant::now() + HEARTBEAT;
            say_hello(shared);
        }
        match reader.read(&mut buffer) {
            Ok(length) => {
                let bytes = buffer.get(..length).unwrap_or_default();
                take(shared, &reader, &mut framer, bytes);
            }
            Err(error) => {
                // The device is closed before another user may open it.
                drop(reader);
                shared.fail(LinkError::Failed { address: shared.address().clone(), source: Arc::new(error) });
                return;
            }
        }
    }
}

/// Processes the bytes of one read; empty after a timeout.
fn take(shared: &Shared, reader: &Reader, framer: &mut Framer, bytes: &[u8]) {
    let arrival = shared.clock().now();
    let mut has_peer = false;
    let mut deliver = |item: Item| has_peer |= shared.deliver(item, arrival);
    // Incomplete bytes are discarded if nothing follows, or if a datagram begins with a frame of its own.
    if bytes.is_empty() || reader.is_datagrams() && framer.is_waiting() && begins_with_message(bytes) {
        std::iter::from_fn(|| framer.next_at_end()).for_each(&mut deliver);
    }
    framer.push(bytes);
    std::iter::from_fn(|| framer.next()).for_each(&mut deliver);
    if has_peer {
        reader.accept_peer();
    }
    shared.count_skipped(framer.skipped());
}

fn say_hello(shared: &Shared) {
    let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode: 0,
        mavtype: MavType::MAV_TYPE_ONBOARD_CONTROLLER,
        autopilot: MavAutopilot::MAV_AUTOPILOT_INVALID,
        base_mode: MavModeFlag::empty(),
        system_status: MavState::MAV_STATE_ACTIVE,
        // The version of the protocol, which the specification fixes.
        mavlink_version: 3,
    });
    for identity in shared.identities() {
        // A failed write is counted, and the next read reports why.
        let _ = shared.send(&identity, &heartbeat);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Address;
    use crate::link::Peer;
    use crate::transport;
    use mavlink::{MavHeader, MavlinkVersion, MessageData, write_versioned_msg};

    /// Frame that breaks off: the reader does not wait for the bytes that its header announces.
    #[test]
    fn a_datagram_that_is_cut_off_does_not_delay_the_next_one() {
        let address = Address::UdpOut { remote: "127.0.0.1:9".into() };
        let (reader, writer) = transport::open(&address).expect("it opens");
        let shared = Shared::new(address, writer);
        let inbox = shared.listen(Peer { system_id: 0, component_id: 0 }, &[HEARTBEAT_DATA::ID], 4);
        let mut whole = Vec::new();
        let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
        write_versioned_msg(&mut whole, MavlinkVersion::V2, MavHeader::default(), &heartbeat)
            .expect("a vector takes all");
        let mut framer = Framer::default();
        take(&shared, &reader, &mut framer, &[0xfd, 255, 0, 0, 0, 1, 1, 0, 0, 0, 7]);
        take(&shared, &reader, &mut framer, &whole);
        assert!(inbox.receive(Duration::ZERO).is_ok_and(|received| received.is_some()));
        // One that is split between two datagrams is found, too.
        let (first, second) = whole.split_at(9);
        take(&shared, &reader, &mut framer, first);
        take(&shared, &reader, &mut framer, second);
        assert!(inbox.receive(Duration::ZERO).is_ok_and(|received| received.is_some()));
    }
}
