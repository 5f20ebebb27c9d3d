//! Keys and attachments.

use bb_core::MonotonicTime;

/// The key of the messages at a path, in the layout with that hash.
pub(super) fn message_key(robot: &str, path: &str, hash: &str) -> String {
    format!("bb/{robot}/{path}/{hash}")
}

/// The key of the messages at a path in any layout.
pub(super) fn any_layout(robot: &str, path: &str) -> String {
    message_key(robot, path, "*")
}

/// The key of the clock of a robot. `*` does not match it.
pub(super) fn clock_key(robot: &str) -> String {
    format!("bb/{robot}/@clock")
}

/// The hash of the layout, from the key of a message.
pub(super) fn hash_in(key: &str) -> &str {
    key.rsplit('/').next().unwrap_or(key)
}

/// The attachment of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Attachment {
    /// Number of the run that sends.
    pub(super) session: u64,
    /// Number of the message at its path, counting those that the sender had no room for.
    pub(super) sequence: u64,
    /// Time of the measurement, on the sender's clock.
    pub(super) measured: MonotonicTime,
    /// Time at which it was put, on the sender's clock.
    pub(super) sent: MonotonicTime,
}

impl Attachment {
    pub(super) fn to_bytes(self) -> Vec<u8> {
        bytes([self.session, self.sequence, raw(self.measured), raw(self.sent)])
    }

    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let [session, sequence, measured, sent] = numbers(bytes)?;
        Some(Self { session, sequence, measured: time(measured), sent: time(sent) })
    }
}

/// The answer to a question for the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ClockAnswer {
    /// Number of the run that answers.
    pub(super) session: u64,
    /// Time at which the question came, on its clock.
    pub(super) received: MonotonicTime,
    /// Time at which it was answered, on its clock.
    pub(super) answered: MonotonicTime,
}

impl ClockAnswer {
    pub(super) fn to_bytes(self) -> Vec<u8> {
        bytes([self.session, raw(self.received), raw(self.answered)])
    }

    pub(super) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let [session, received, answered] = numbers(bytes)?;
        Some(Self { session, received: time(received), answered: time(answered) })
    }
}

fn raw(time: MonotonicTime) -> u64 {
    time.as_nanos().cast_unsigned()
}

fn time(raw: u64) -> MonotonicTime {
    MonotonicTime::from_nanos(raw.cast_signed())
}

fn bytes<const N: usize>(numbers: [u64; N]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn numbers<const N: usize>(bytes: &[u8]) -> Option<[u64; N]> {
    let (chunks, rest) = bytes.as_chunks::<8>();
    let chunks: &[[u8; 8]; N] = chunks.try_into().ok().filter(|_| rest.is_empty())?;
    Some(chunks.map(u64::from_le_bytes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_is_written_is_read() {
        let (measured, sent) = (MonotonicTime::from_nanos(-3), MonotonicTime::MAX);
        let attachment = Attachment { session: 1, sequence: u64::MAX, measured, sent };
        assert_eq!(Attachment::from_bytes(&attachment.to_bytes()), Some(attachment));
        let answer = ClockAnswer { session: 7, received: measured, answered: sent };
        assert_eq!(ClockAnswer::from_bytes(&answer.to_bytes()), Some(answer));
        assert_eq!(hash_in(&message_key("Mast", "sensor/mast/gnss", "RIHS01_aa")), "RIHS01_aa");
    }

    proptest! {
        #[test]
        fn other_bytes_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..80)) {
            prop_assert_eq!(Attachment::from_bytes(&bytes).is_some(), bytes.len() == 32);
            prop_assert_eq!(ClockAnswer::from_bytes(&bytes).is_some(), bytes.len() == 24);
        }
    }
}
