//! The attachment of each message and each request: its number, its time and who sent it.

use crate::Gid;
use thiserror::Error;

/// The bytes of an attachment as all releases since August 2025 write it.
pub const ATTACHMENT_BYTES: usize = 33;

/// Data sent beside a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// The number of the message, counted by its publisher from 1; of a response, that of the request.
    pub sequence: i64,
    /// The wall time at which it was sent, in nanoseconds since the Unix epoch.
    pub time_ns: i64,
    /// The publisher or the client.
    pub gid: Gid,
}

/// Bytes that are not an attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("an attachment of {length} bytes: {fault}")]
pub struct AttachmentError {
    length: usize,
    fault: &'static str,
}

/// The names of the parts in Jazzy up to `rmw_zenoh_cpp` 0.2.3.
const LABELS: [&str; 3] = ["sequence_number", "source_timestamp", "source_gid"];

impl Attachment {
    /// The bytes: two integers, little endian, then the id after its length.
    pub fn to_bytes(&self) -> [u8; ATTACHMENT_BYTES] {
        let mut bytes = [0; ATTACHMENT_BYTES];
        let (numbers, gid) = bytes.split_at_mut(16);
        let (sequence, time) = numbers.split_at_mut(8);
        sequence.copy_from_slice(&self.sequence.to_le_bytes());
        time.copy_from_slice(&self.time_ns.to_le_bytes());
        if let [length, gid @ ..] = gid {
            *length = Gid::BYTES as u8;
            gid.copy_from_slice(&self.gid.0);
        }
        bytes
    }

    /// Reads an attachment of any release, with labels or without.
    ///
    /// # Errors
    /// The bytes have neither of the two forms.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, AttachmentError> {
        let error = |fault| AttachmentError { length: bytes.len(), fault };
        let is_labelled = bytes.len() != ATTACHMENT_BYTES;
        let mut rest = bytes;
        let [sequence, time, gid] = LABELS.map(|label| match (is_labelled, label) {
            (true, label) if list(&mut rest) != Some(label.as_bytes()) => {
                Err("it is neither one of 33 bytes, nor labelled")
            }
            (_, "source_gid") => list(&mut rest).ok_or("it ends within the id"),
            _ => integer(&mut rest).ok_or("it ends within a number"),
        });
        let number = |part: Result<&[u8], &'static str>| {
            part.map(|bytes| bytes.try_into().map_or(0, i64::from_le_bytes)).map_err(error)
        };
        let (sequence, time_ns) = (number(sequence)?, number(time)?);
        let gid = gid.map_err(error)?.try_into().map_err(|_| error("its id does not have 16 bytes"))?;
        match rest {
            [] => Ok(Self { sequence, time_ns, gid: Gid(gid) }),
            _ => Err(error("it goes on after the id")),
        }
    }
}

/// The next eight bytes.
fn integer<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (integer, after) = rest.split_at_checked(8)?;
    *rest = after;
    Some(integer)
}

/// The next bytes after their number, which is below 128 in every attachment.
fn list<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, after) = rest.split_first().filter(|(length, _)| **length < 128)?;
    let (list, after) = after.split_at_checked(usize::from(*length))?;
    *rest = after;
    Some(list)
}
