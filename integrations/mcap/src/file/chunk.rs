//! The records of one chunk, decompressed by mcap.

use super::fields::Fields;
use super::frame::{FRAME, LIMIT};
use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// A chunk, or the available part of it.
pub(super) enum Chunk {
    /// Complete, or compressed.
    Read { reader: Box<LinearReader>, is_whole: bool },
    /// The beginning of an uncompressed chunk.
    Beginning { data: Vec<u8>, at: usize },
}

/// Reason for which a chunk cannot be read, or not further.
pub(super) enum ChunkFault {
    /// End of a chunk that is cut off, as was known.
    Ends,
    Corrupt(String),
    TooLarge(u64),
    Compression(String),
}

impl From<&str> for ChunkFault {
    fn from(fault: &str) -> Self {
        Self::Corrupt(fault.to_owned())
    }
}

impl Chunk {
    /// Prepares to read a chunk's record, without its frame.
    pub(super) fn open(body: &[u8], is_whole: bool) -> Result<Self, ChunkFault> {
        // The beginning of a chunk may end within its head.
        let Some(head) = Head::parse(body) else {
            return Err(if is_whole { "the head of the chunk is malformed".into() } else { ChunkFault::Ends });
        };
        let Head { unpacked, compression, packed, data } = head;
        if is_whole && packed != data.len() as u64 {
            return Err("the chunk has another length than it says".into());
        }
        match compression {
            "" if !is_whole => {
                let length = data.len().min(usize::try_from(packed).unwrap_or(usize::MAX));
                return Ok(Self::Beginning { data: data[..length].to_vec(), at: 0 });
            }
            // mcap decrements the remaining bytes of an uncompressed chunk without a check, and would underflow.
            "" if unpacked != packed || !is_framed(data) => {
                return Err("a record in the chunk runs over its end".into());
            }
            "" | "lz4" | "zstd" => {}
            other => return Err(ChunkFault::Compression(other.to_owned())),
        }
        if unpacked > LIMIT {
            return Err(ChunkFault::TooLarge(unpacked));
        }
        // No record of this chunk can be longer than this, compressed or not.
        let longest = body.len().max(usize::try_from(unpacked).unwrap_or(usize::MAX));
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            // The checksum of a chunk that is cut off is unknown.
            .with_prevalidate_chunk_crcs(is_whole)
            .with_record_length_limit(longest);
        let mut reader = Box::new(LinearReader::new_with_options(options));
        // The missing bytes are announced, so that mcap treats the chunk as cut off.
        let head = (body.len() - data.len()) as u64;
        let length = if is_whole { body.len() as u64 } else { head.saturating_add(packed) };
        let room = reader.insert(FRAME + body.len());
        room[0] = op::CHUNK;
        room[1..FRAME].copy_from_slice(&length.to_le_bytes());
        room[FRAME..FRAME + body.len()].copy_from_slice(body);
        reader.notify_read(FRAME + body.len());
        Ok(Self::Read { reader, is_whole })
    }

    /// Puts the next record's bytes into `body` and returns its kind; `None` at the end.
    pub(super) fn next(&mut self, body: &mut Vec<u8>) -> Result<Option<u8>, ChunkFault> {
        let (opcode, data) = match self {
            Self::Beginning { data, at } => {
                let record = data.get(*at..).and_then(split);
                let (opcode, record) = record.ok_or(ChunkFault::Ends)?;
                *at += FRAME + record.len();
                (opcode, record)
            }
            Self::Read { reader, is_whole } => {
                // It was given all bytes at once, so a request for more means that the chunk is over or cut off. Told
                // that nothing follows, mcap knows which. If it cannot proceed, it asks a second time.
                let mut has_asked = false;
                loop {
                    match reader.next_event() {
                        Some(Ok(LinearReadEvent::ReadRequest(_))) if has_asked && !*is_whole => {
                            return Err(ChunkFault::Ends);
                        }
                        Some(Ok(LinearReadEvent::ReadRequest(_))) => {
                            reader.notify_read(0);
                            has_asked = true;
                        }
                        Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                            body.clear();
                            body.extend_from_slice(data);
                            return Ok(Some(opcode));
                        }
                        Some(Err(_)) if !*is_whole => return Err(ChunkFault::Ends),
                        Some(Err(error)) => return Err(ChunkFault::Corrupt(fault(error))),
                        None if !*is_whole => return Err(ChunkFault::Ends),
                        None => return Ok(None),
                    }
                }
            }
        };
        body.clear();
        body.extend_from_slice(data);
        Ok(Some(opcode))
    }
}

/// The header of a chunk.
struct Head<'a> {
    /// Decompressed length.
    unpacked: u64,
    compression: &'a str,
    /// Stored length.
    packed: u64,
    /// The available part of it.
    data: &'a [u8],
}

impl<'a> Head<'a> {
    fn parse(body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        let _start = fields.u64()?;
        let _end = fields.u64()?;
        let unpacked = fields.u64()?;
        let _crc = fields.u32()?;
        let compression = fields.text()?;
        let packed = fields.u64()?;
        Some(Self { unpacked, compression, packed, data: fields.0 })
    }
}

/// Returns the first of several records: its kind and its bytes.
fn split(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let mut fields = Fields(bytes);
    let [opcode] = fields.number::<1>()?;
    let length = fields.u64()?;
    Some((opcode, fields.take(length)?))
}

/// Returns whether the bytes are a sequence of complete records.
fn is_framed(mut records: &[u8]) -> bool {
    while !records.is_empty() {
        let Some((_, record)) = split(records) else { return false };
        records = &records[FRAME + record.len()..];
    }
    true
}

/// The meaning of a chunk's error, in words.
fn fault(error: McapError) -> String {
    match error {
        McapError::BadChunkCrc { saved, calculated } => {
            format!("the checksum of the chunk is {calculated:08x}, and {saved:08x} was recorded")
        }
        McapError::DecompressionError(what) => format!("the chunk cannot be unpacked ({what})"),
        McapError::Io(cause) => format!("the chunk cannot be unpacked ({cause})"),
        McapError::UnexpectedEof | McapError::UnexpectedEoc => "the chunk ends in the middle of a record".into(),
        McapError::RecordTooLarge { .. } => "a record in the chunk runs over its end".into(),
        other => format!("the chunk is malformed ({other})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
        let mut bytes = vec![opcode];
        bytes.extend(length.to_le_bytes());
        bytes.extend(body);
        bytes
    }

    #[test]
    fn whole_records_are_framed() {
        assert!(is_framed(&[]));
        assert!(is_framed(&[record(5, 2, &[1, 2]), record(4, 0, &[])].concat()));
        assert!(!is_framed(&record(5, 3, &[1, 2])));
        assert!(!is_framed(&record(5, u64::MAX, &[1, 2])));
        assert!(!is_framed(&record(5, 1, &[1, 2])));
    }
}
