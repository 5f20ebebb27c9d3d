//! The records of a bag in the order of the file, those inside chunks included.
//!
//! The records of the file are framed here rather than by mcap: a place in the file can then be named exactly, a
//! length is compared with the file before anything is allocated for it, and what is not needed (attachments,
//! indexes) is skipped unread. mcap unpacks the chunks.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::{ChunkHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};

use crate::error::BagErrorKind;

/// The longest record or unpacked chunk that is taken, in bytes. Recorders make chunks of about a megabyte; what
/// exceeds this by far is damage, and would be believed to the point of filling the memory.
const LIMIT: u64 = 256 << 20;

/// Every record starts with its kind (one byte) and its length (eight bytes, little endian).
pub(crate) const FRAME: usize = 1 + 8;

/// Splits the frame of a record into kind and length.
pub(crate) fn unframe(frame: [u8; FRAME]) -> (u8, u64) {
    let [opcode, length @ ..] = frame;
    (opcode, u64::from_le_bytes(length))
}

/// A file, and where in it the reading is.
pub(crate) struct Records {
    file: BufReader<File>,
    /// The size of the file when it was opened. A recorder may still be writing to it.
    size: u64,
    /// Whether the file ends as a finished bag does, so that running over its end is damage and not truncation.
    finished: bool,
    /// Where the next record of the file starts.
    next: u64,
    /// Where the current record starts, or the chunk it is in.
    byte: u64,
    /// The chunk that is being read.
    chunk: Option<LinearReader>,
    /// The current record.
    body: Vec<u8>,
    /// Messages before the current record.
    messages: u64,
    /// Whether the current record is one.
    in_message: bool,
}

impl Records {
    /// Opens the file and looks at both of its ends.
    pub(crate) fn open(path: &Path) -> Result<Self, BagErrorKind> {
        let io = |cause: io::Error| match cause.kind() {
            io::ErrorKind::NotFound => BagErrorKind::Missing,
            _ => BagErrorKind::Io { byte: 0, cause },
        };
        // Asked before opening: opening a pipe would wait for a writer.
        let about = std::fs::metadata(path).map_err(io)?;
        if !about.is_file() {
            return Err(BagErrorKind::NotAFile);
        }
        let mut file = BufReader::new(File::open(path).map_err(io)?);
        let size = about.len();
        let magic = MAGIC.len() as u64;

        let mut start = Vec::new();
        file.by_ref().take(16).read_to_end(&mut start).map_err(io)?;
        if !start.starts_with(MAGIC) {
            return Err(match MAGIC.starts_with(&start) {
                true => BagErrorKind::Truncated { messages: 0, byte: 0, size },
                false => BagErrorKind::NotMcap { found: guess(&start) },
            });
        }

        let mut end = Vec::new();
        file.seek(SeekFrom::Start(size.saturating_sub(magic).max(magic))).map_err(io)?;
        file.by_ref().take(magic).read_to_end(&mut end).map_err(io)?;
        file.seek(SeekFrom::Start(magic)).map_err(io)?;
        let finished = end == MAGIC;
        let body = Vec::new();
        Ok(Self {
            file,
            size,
            finished,
            next: magic,
            byte: magic,
            chunk: None,
            body,
            messages: 0,
            in_message: false,
        })
    }

    /// The size of the file in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// The file itself, for whoever wants to look elsewhere in it; reading on from there is not possible.
    pub(crate) fn into_file(self) -> BufReader<File> {
        self.file
    }

    /// The current record, without its frame.
    pub(crate) fn body(&self) -> &[u8] {
        &self.body
    }

    /// Where the current record starts, or the chunk it is in.
    pub(crate) fn byte(&self) -> u64 {
        self.byte
    }

    /// The error for a fault in the current record.
    pub(crate) fn corrupt(&self, fault: impl Into<String>) -> BagErrorKind {
        BagErrorKind::Corrupt { messages: self.messages, byte: self.byte, fault: fault.into() }
    }

    /// Steps to the next schema, channel or message and returns its kind; `None` at the end of the data.
    pub(crate) fn advance(&mut self) -> Result<Option<u8>, BagErrorKind> {
        self.messages += u64::from(std::mem::take(&mut self.in_message));
        loop {
            let opcode = match &mut self.chunk {
                None => match self.step_in_file()? {
                    op::DATA_END | op::FOOTER => return Ok(None),
                    op::CHUNK => {
                        self.chunk = Some(self.unpack()?);
                        continue;
                    }
                    opcode => opcode,
                },
                Some(chunk) => match chunk.next_event() {
                    Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                        self.body.clear();
                        self.body.extend_from_slice(data);
                        opcode
                    }
                    // It was given the whole chunk at once, so either the chunk is over or it breaks off; told
                    // that nothing follows, the reader knows which.
                    Some(Ok(LinearReadEvent::ReadRequest(_))) => {
                        chunk.notify_read(0);
                        continue;
                    }
                    None => {
                        self.chunk = None;
                        continue;
                    }
                    Some(Err(error)) => {
                        let fault = chunk_fault(error);
                        return Err(self.corrupt(fault));
                    }
                },
            };
            match opcode {
                op::SCHEMA | op::CHANNEL => return Ok(Some(opcode)),
                op::MESSAGE => {
                    self.in_message = true;
                    return Ok(Some(opcode));
                }
                _ => {}
            }
        }
    }

    /// Reads the next record of the file and returns its kind; the body only of the kinds that matter.
    fn step_in_file(&mut self) -> Result<u8, BagErrorKind> {
        self.byte = self.next;
        let left = self.size.saturating_sub(self.next);
        if left < FRAME as u64 {
            return Err(self.overrun());
        }
        let mut frame = [0; FRAME];
        self.file.read_exact(&mut frame).map_err(|e| self.io(e))?;
        let (opcode, length) = unframe(frame);
        if length > left - FRAME as u64 {
            return Err(self.overrun());
        }
        self.next += FRAME as u64 + length;
        match opcode {
            op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK => {
                self.within_limit(length)?;
                self.body.clear();
                let got = self.file.by_ref().take(length).read_to_end(&mut self.body).map_err(|e| self.io(e))?;
                if (got as u64) < length {
                    return Err(self.overrun());
                }
            }
            _ => {
                self.file.seek(SeekFrom::Start(self.next)).map_err(|e| self.io(e))?;
            }
        }
        Ok(opcode)
    }

    /// Prepares to read the chunk in `body`.
    fn unpack(&self) -> Result<LinearReader, BagErrorKind> {
        let Ok(Record::Chunk { header, data }) = mcap::parse_record(op::CHUNK, &self.body) else {
            return Err(self.corrupt("the head of the chunk is malformed"));
        };
        let ChunkHeader { compression, uncompressed_size, .. } = header;
        match compression.as_str() {
            // mcap counts down the bytes of an unpacked chunk without looking and would underflow.
            "" if !framed(&data) => return Err(self.corrupt("a record in the chunk runs over its end")),
            "" | "lz4" | "zstd" => self.within_limit(uncompressed_size)?,
            _ => {
                return Err(BagErrorKind::Compression { byte: self.byte, compression });
            }
        }
        // No record of this chunk can be longer than this, packed or unpacked.
        let longest = self.body.len().max(uncompressed_size as usize);
        let mut reader = LinearReader::new_with_options(
            LinearReaderOptions::default()
                .with_skip_start_magic(true)
                .with_skip_end_magic(true)
                .with_prevalidate_chunk_crcs(true)
                .with_record_length_limit(longest),
        );
        let record = reader.insert(FRAME + self.body.len());
        record[0] = op::CHUNK;
        record[1..FRAME].copy_from_slice(&(self.body.len() as u64).to_le_bytes());
        record[FRAME..FRAME + self.body.len()].copy_from_slice(&self.body);
        reader.notify_read(FRAME + self.body.len());
        Ok(reader)
    }

    fn within_limit(&self, length: u64) -> Result<(), BagErrorKind> {
        if length <= LIMIT {
            return Ok(());
        }
        Err(BagErrorKind::TooLarge { messages: self.messages, byte: self.byte, length, limit: LIMIT })
    }

    /// The error for a record that the file is too short for.
    fn overrun(&self) -> BagErrorKind {
        match self.finished {
            true => self.corrupt("a record runs over the end of the file"),
            false => BagErrorKind::Truncated { messages: self.messages, byte: self.byte, size: self.size },
        }
    }

    fn io(&self, cause: io::Error) -> BagErrorKind {
        match cause.kind() {
            // The file has become shorter since it was opened.
            io::ErrorKind::UnexpectedEof => self.overrun(),
            _ => BagErrorKind::Io { byte: self.byte, cause },
        }
    }
}

/// Whether the bytes are a row of whole records.
fn framed(mut records: &[u8]) -> bool {
    while let Some((frame, rest)) = records.split_first_chunk() {
        let (_, length) = unframe(*frame);
        match usize::try_from(length).ok().and_then(|length| rest.get(length..)) {
            Some(rest) => records = rest,
            None => return false,
        }
    }
    records.is_empty()
}

/// What a chunk's error means, in words.
fn chunk_fault(error: McapError) -> String {
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

/// What a file that is not MCAP is likely to be.
fn guess(start: &[u8]) -> &'static str {
    if start.starts_with(b"SQLite format 3") {
        "it is an SQLite database; if it is a ROS 2 bag, convert it with `ros2 bag convert` to storage `mcap`"
    } else if start.starts_with(b"#ROSBAG") {
        "it is a ROS 1 bag; convert it to a ROS 2 bag with storage `mcap`"
    } else if start.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        "it is packed as a whole with zstd; unpack it with `zstd -d`"
    } else {
        "it does not start with MCAP's magic bytes; record or convert with storage `mcap`"
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
        assert!(framed(&[]));
        assert!(framed(&[record(5, 2, &[1, 2]), record(4, 0, &[])].concat()));
        assert!(!framed(&record(5, 3, &[1, 2])));
        assert!(!framed(&record(5, u64::MAX, &[1, 2])));
        assert!(!framed(&record(5, 1, &[1, 2])));
    }

    #[test]
    fn other_formats_are_recognised() {
        assert!(guess(b"SQLite format 3\0").contains("ros2 bag convert"));
        assert!(guess(b"#ROSBAG V2.0\n").contains("ROS 1"));
        assert!(guess(b"t,x,y").contains("magic"));
    }
}
