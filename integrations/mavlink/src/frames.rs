//! Frames in a stream of bytes.
//!
//! The crate's own reader distinguishes neither noise from frames of other dialects nor the end of a datagram, and
//! counts neither. A frame of another dialect has to be recognised, since its sequence number would otherwise count
//! as lost.

use mavlink::consts::{self, v1, v2};
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MAV_STX, MAV_STX_V2, MavHeader, MavlinkVersion, Message, calculate_crc};

/// Frame that was found.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Item {
    /// A message of the dialect.
    Message(MavHeader, Box<MavMessage>),
    /// A frame of another dialect, whose checksum cannot be verified.
    Unknown(MavHeader),
    /// A frame with a good checksum whose content is not in the dialect, for example an unknown enumeration value.
    Invalid(MavHeader),
}

/// Finds frames in bytes that arrive in pieces.
#[derive(Debug, Default)]
pub(crate) struct Framer {
    buffer: Vec<u8>,
    /// Number of bytes at the front of the buffer that have been processed.
    start: usize,
    /// No message begins before this, except at `start`. It keeps the work linear in the bytes, for any noise.
    clean: usize,
    skipped: u64,
}

/// The meaning of the bytes after a marker.
enum Candidate {
    /// Bytes that may become a frame.
    Partial,
    /// Bytes that are not a frame.
    Noise,
    Frame(usize, Item),
}

impl Framer {
    /// Bytes that belonged to no frame.
    pub(crate) fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Adds bytes. Call [`Self::next`] until it returns `None` before adding more.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.buffer.drain(..self.start);
        self.start = 0;
        self.clean = 0;
        self.buffer.extend_from_slice(bytes);
    }

    /// Returns whether bytes are waiting that may become a frame.
    pub(crate) fn is_waiting(&self) -> bool {
        self.start < self.buffer.len()
    }

    /// The next frame, if it is complete.
    pub(crate) fn next(&mut self) -> Option<Item> {
        self.find(false)
    }

    /// The next frame if no more bytes will come: an incomplete one is discarded.
    pub(crate) fn next_at_end(&mut self) -> Option<Item> {
        self.find(true)
    }

    fn find(&mut self, is_end: bool) -> Option<Item> {
        loop {
            let pending = self.buffer.get(self.start..).unwrap_or_default();
            let offset = pending.iter().position(|byte| is_marker(*byte)).unwrap_or(pending.len());
            self.skip(offset);
            let pending = self.buffer.get(self.start..).unwrap_or_default();
            if pending.is_empty() {
                return None;
            }
            let mut clean = self.clean.saturating_sub(self.start);
            let candidate = examine(pending, &mut clean);
            self.clean = self.start + clean;
            match candidate {
                Candidate::Partial if !is_end => return None,
                Candidate::Partial | Candidate::Noise => self.skip(1),
                Candidate::Frame(length, item) => {
                    self.start += length;
                    return Some(item);
                }
            }
        }
    }

    fn skip(&mut self, length: usize) {
        self.start += length;
        self.skipped += length as u64;
    }
}

/// Returns whether the bytes begin with a whole message of the dialect.
pub(crate) fn begins_with_message(bytes: &[u8]) -> bool {
    bytes.first().is_some_and(|byte| is_marker(*byte))
        && matches!(examine_known(bytes), Some(Candidate::Frame(_, Item::Message(..))))
}

fn is_marker(byte: u8) -> bool {
    byte == MAV_STX || byte == MAV_STX_V2
}

/// `bytes` begins with a marker; no further message begins before `clean`.
fn examine(bytes: &[u8], clean: &mut usize) -> Candidate {
    if let Some(known) = examine_known(bytes) {
        return known;
    }
    let Some(layout) = Layout::of(bytes) else { return Candidate::Partial };
    if bytes.len() < layout.length {
        return Candidate::Partial;
    }
    // Of another dialect, or noise: it ends where another frame begins or nothing follows, and contains no known
    // frame.
    if bytes.get(layout.length).is_some_and(|byte| !is_marker(*byte)) {
        return Candidate::Noise;
    }
    let other = ((*clean).max(1)..layout.length).find(|at| bytes.get(*at..).is_some_and(begins_with_message));
    *clean = (*clean).max(other.unwrap_or(layout.length));
    match other {
        Some(_) => Candidate::Noise,
        None => Candidate::Frame(layout.length, Item::Unknown(layout.header)),
    }
}

/// `None` if the message is of another dialect.
fn examine_known(bytes: &[u8]) -> Option<Candidate> {
    if bytes.first() == Some(&MAV_STX_V2)
        && bytes.get(v2::INCOMPAT_FLAGS_OFFSET).is_some_and(|flags| flags & !v2::SUPPORTED_IFLAGS != 0)
    {
        return Some(Candidate::Noise);
    }
    let Some(layout) = Layout::of(bytes) else { return Some(Candidate::Partial) };
    let extra_crc = MavMessage::extra_crc(layout.id);
    // Some message may have this one.
    if extra_crc == 0 && MavMessage::default_message_from_id(layout.id).is_none() {
        return None;
    }
    let Some(frame) = bytes.get(..layout.length) else { return Some(Candidate::Partial) };
    let checked = frame.get(consts::STX_SIZE..layout.checksum)?;
    let checksum = frame.get(layout.checksum..layout.checksum + consts::CHECKSUM_SIZE)?;
    if calculate_crc(checked, extra_crc).to_le_bytes() != *checksum {
        return Some(Candidate::Noise);
    }
    let payload = frame.get(layout.payload..layout.checksum)?;
    let item = match MavMessage::parse(layout.version, layout.id, payload) {
        Ok(message) => Item::Message(layout.header, Box::new(message)),
        Err(_) => Item::Invalid(layout.header),
    };
    Some(Candidate::Frame(layout.length, item))
}

/// The offsets of a frame's parts.
struct Layout {
    version: MavlinkVersion,
    header: MavHeader,
    id: u32,
    payload: usize,
    checksum: usize,
    length: usize,
}

impl Layout {
    /// `None` if the header is incomplete.
    fn of(bytes: &[u8]) -> Option<Self> {
        let at = |index: usize| bytes.get(index).copied();
        let payload_length = usize::from(at(consts::PAYLOAD_LEN_OFFSET)?);
        let (version, ids, id, header_size, signature) = if at(consts::STX_OFFSET)? == MAV_STX {
            (MavlinkVersion::V1, 2, u32::from(at(5)?), v1::HEADER_SIZE, 0)
        } else {
            let is_signed = at(v2::INCOMPAT_FLAGS_OFFSET)? & v2::IFLAG_SIGNED != 0;
            let signature = if is_signed { v2::SIGNATURE_SIZE } else { 0 };
            (MavlinkVersion::V2, 4, u32::from_le_bytes([at(7)?, at(8)?, at(9)?, 0]), v2::HEADER_SIZE, signature)
        };
        let header = MavHeader { sequence: at(ids)?, system_id: at(ids + 1)?, component_id: at(ids + 2)? };
        let payload = consts::STX_SIZE + header_size;
        let checksum = payload + payload_length;
        Some(Self { version, header, id, payload, checksum, length: checksum + consts::CHECKSUM_SIZE + signature })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bb_tests::laws;
    use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, SYSTEM_TIME_DATA};
    use mavlink::write_versioned_msg;
    use proptest::prelude::*;

    fn header(sequence: u8) -> MavHeader {
        MavHeader { system_id: 7, component_id: 9, sequence }
    }

    fn frame(version: MavlinkVersion, sequence: u8) -> (Vec<u8>, Item) {
        let message = MavMessage::SYSTEM_TIME(SYSTEM_TIME_DATA { time_unix_usec: 0xfd_fe_fd_fe, time_boot_ms: 77 });
        let mut bytes = Vec::new();
        write_versioned_msg(&mut bytes, version, header(sequence), &message).expect("a vector takes all");
        (bytes, Item::Message(header(sequence), Box::new(message)))
    }

    fn all(framer: &mut Framer) -> Vec<Item> {
        std::iter::from_fn(|| framer.next()).collect()
    }

    /// A frame of the dialect `ualberta`: NAV_FILTER_BIAS, 220.
    fn unknown(sequence: u8) -> Vec<u8> {
        let mut bytes = vec![MAV_STX_V2, 28, 0, 0, sequence, 7, 9, 220, 0, 0];
        bytes.extend([0x11; 30]);
        bytes
    }

    #[test]
    fn frames_of_other_dialects_are_distinguished_from_noise() {
        let mut framer = Framer::default();
        framer.push(&[&unknown(3)[..], &frame(MavlinkVersion::V2, 4).0, &unknown(5)].concat());
        let items = all(&mut framer);
        assert_eq!(items, [Item::Unknown(header(3)), frame(MavlinkVersion::V2, 4).1, Item::Unknown(header(5))]);
        assert_eq!(framer.skipped(), 0);
    }

    #[test]
    fn a_frame_that_noise_would_swallow_is_found() {
        // The noise looks like a frame of another dialect that ends with the real one.
        let (real, item) = frame(MavlinkVersion::V2, 1);
        let length = u8::try_from(real.len()).expect("it is short") - 2;
        let mut bytes = vec![MAV_STX_V2, length, 0, 0, 0, 1, 1, 220, 0, 0];
        bytes.extend(&real);
        let mut framer = Framer::default();
        framer.push(&bytes);
        assert_eq!(all(&mut framer), [item]);
        assert_eq!(framer.skipped(), 10);
    }

    #[test]
    fn a_value_that_no_enumeration_has_is_invalid() {
        let mut bytes = Vec::new();
        let heartbeat = MavMessage::HEARTBEAT(HEARTBEAT_DATA::default());
        write_versioned_msg(&mut bytes, MavlinkVersion::V1, header(0), &heartbeat).expect("a vector takes all");
        bytes[v1::HEADER_SIZE + 1 + 4] = 250;
        let end = bytes.len() - 2;
        let crc = calculate_crc(&bytes[1..end], MavMessage::extra_crc(0));
        bytes[end..].copy_from_slice(&crc.to_le_bytes());
        let mut framer = Framer::default();
        framer.push(&bytes);
        assert_eq!(all(&mut framer), [Item::Invalid(header(0))]);
    }

    #[test]
    fn a_frame_that_is_cut_off_is_given_up_at_the_end() {
        let (bytes, item) = frame(MavlinkVersion::V2, 0);
        let mut framer = Framer::default();
        // A header that announces more than comes, then a whole frame.
        framer.push(&[&[MAV_STX_V2, 200, 0, 0, 0, 1, 1, 0, 0, 0][..], &bytes].concat());
        assert_eq!(all(&mut framer), []);
        assert!(framer.is_waiting());
        assert_eq!(framer.next_at_end(), Some(item));
        assert_eq!((framer.next_at_end(), framer.is_waiting(), framer.skipped()), (None, false, 10));
    }

    laws! {
        /// Bytes known not to be a frame are not examined again, which changes nothing.
        #[test]
        fn a_frame_within_noise_is_found_where_it_is(pieces in proptest::collection::vec(pieces(), 1..12), cut in 1..200_usize) {
            let bytes = pieces.concat();
            let found = |cut: usize| {
                let mut framer = Framer::default();
                let mut found = Vec::new();
                for piece in bytes.chunks(cut) {
                    framer.push(piece);
                    found.extend(std::iter::from_fn(|| {
                        framer.clean = 0;
                        framer.next()
                    }));
                }
                found
            };
            let mut framer = Framer::default();
            let mut fast = Vec::new();
            for piece in bytes.chunks(cut) {
                framer.push(piece);
                fast.extend(all(&mut framer));
            }
            prop_assert_eq!(fast, found(cut));
        }

        #[test]
        fn no_bytes_panic_and_each_is_accounted_for(pieces in proptest::collection::vec(noise(), 0..6)) {
            let mut framer = Framer::default();
            for piece in &pieces {
                framer.push(piece);
                while framer.next().is_some() {}
                prop_assert!(framer.buffer.len() - framer.start <= consts::MAX_FRAME_SIZE);
            }
            while framer.next_at_end().is_some() {}
            prop_assert!(!framer.is_waiting());
            prop_assert!(framer.skipped() <= pieces.iter().map(|piece| piece.len() as u64).sum());
        }

        #[test]
        fn a_frame_with_a_wrong_bit_is_no_message(bit in 8_usize.., is_old in any::<bool>()) {
            let (mut bytes, _) = frame(if is_old { MavlinkVersion::V1 } else { MavlinkVersion::V2 }, 3);
            let bit = 8 + bit % (8 * bytes.len() - 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
            let mut framer = Framer::default();
            framer.push(&bytes);
            let found: Vec<Item> = std::iter::from_fn(|| framer.next_at_end()).collect();
            prop_assert!(!found.iter().any(|item| matches!(item, Item::Message(..) | Item::Invalid(..))), "{:?}", found);
        }

        /// Without markers in the noise, and however the bytes are cut up, every frame is found.
        #[test]
        fn every_frame_is_found(
            noises in proptest::collection::vec(proptest::collection::vec(0..0xfd_u8, 0..40), 1..12),
            versions in proptest::collection::vec(any::<bool>(), 12),
            cut in 1..60_usize,
        ) {
            let (mut bytes, mut expected) = (Vec::new(), Vec::new());
            for (index, noise) in noises.iter().enumerate() {
                bytes.extend(noise);
                let version = if versions[index] { MavlinkVersion::V1 } else { MavlinkVersion::V2 };
                let (frame, item) = frame(version, index as u8);
                bytes.extend(frame);
                expected.push(item);
            }
            let mut framer = Framer::default();
            let mut found = Vec::new();
            for piece in bytes.chunks(cut) {
                framer.push(piece);
                found.extend(all(&mut framer));
            }
            prop_assert_eq!(found, expected);
            prop_assert_eq!(framer.skipped(), noises.iter().map(|noise| noise.len() as u64).sum::<u64>());
        }
    }

    /// Frames that are known, headers of unknown ones that announce some bytes, and noise.
    fn pieces() -> impl Strategy<Value = Vec<u8>> {
        prop_oneof![
            Just(frame(MavlinkVersion::V2, 1).0),
            Just(frame(MavlinkVersion::V1, 2).0),
            (0..60_u8).prop_map(|length| vec![MAV_STX_V2, length, 0, 0, 0, 1, 1, 220, 0, 0]),
            (0..60_u8).prop_map(|length| vec![MAV_STX, length, 0, 1, 1, 220]),
            proptest::collection::vec(any::<u8>(), 0..20),
        ]
    }

    /// Bytes that are rich in markers.
    fn noise() -> impl Strategy<Value = Vec<u8>> {
        let byte = prop_oneof![any::<u8>(), Just(MAV_STX), Just(MAV_STX_V2), Just(0)];
        proptest::collection::vec(byte, 0..300)
    }
}
