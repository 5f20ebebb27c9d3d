//! The records of a file in order, including those inside chunks, up to the end or the damage.
//!
//! The records of the file are framed here rather than by mcap. A place in the file can then be named exactly, a
//! length is compared with the file before anything is allocated for it, unneeded records (indexes, attachments) are
//! skipped unread, and a chunk that is cut off is read as far as it goes. mcap decompresses the chunks.

use super::chunk::{Chunk, ChunkFault};
use super::frame::{FRAME, LIMIT, unframe};
use super::record::Record;
use crate::error::RecordingErrorKind;
use mcap::MAGIC;
use mcap::records::op;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// A file, and the reading position.
pub(crate) struct Records {
    file: BufReader<File>,
    /// The size of the file when it was opened. A recorder may still be writing to it.
    size: u64,
    /// `true` if the file ends like a complete one, so that running over its end is damage and not truncation.
    is_finished: bool,
    /// `true` if headers, metadata and attachments are wanted as well.
    all: bool,
    /// Byte at which the next record of the file starts.
    next: u64,
    /// Byte at which the current record starts, or the chunk it is in.
    byte: u64,
    /// The chunk being read.
    chunk: Option<Chunk>,
    /// The kind of the current record.
    opcode: u8,
    /// The current record.
    body: Vec<u8>,
    /// Messages before the current record.
    messages: u64,
    /// `true` after the end, and after the damage.
    is_over: bool,
}

impl Records {
    /// Opens a file for its schemas, channels and messages.
    pub(crate) fn open(path: &Path) -> Result<Self, RecordingErrorKind> {
        Self::open_for(path, false)
    }

    /// Opens a file for its header, metadata and attachments too.
    pub(crate) fn open_all(path: &Path) -> Result<Self, RecordingErrorKind> {
        Self::open_for(path, true)
    }

    /// Checks both ends of the file.
    fn open_for(path: &Path, all: bool) -> Result<Self, RecordingErrorKind> {
        let io = |cause: io::Error| match cause.kind() {
            io::ErrorKind::NotFound => RecordingErrorKind::Missing,
            _ => RecordingErrorKind::Read { byte: 0, cause },
        };
        // Checked before opening: opening a pipe would wait for a writer.
        let about = std::fs::metadata(path).map_err(io)?;
        if !about.is_file() {
            return Err(RecordingErrorKind::NotAFile);
        }
        let mut file = BufReader::new(File::open(path).map_err(io)?);
        let size = about.len();
        let magic = MAGIC.len() as u64;

        let mut start = Vec::new();
        file.by_ref().take(16).read_to_end(&mut start).map_err(io)?;
        if !start.starts_with(MAGIC) {
            return Err(match MAGIC.starts_with(&start) {
                true => RecordingErrorKind::Truncated { messages: 0, byte: 0, size },
                false => RecordingErrorKind::NotMcap { found: guess(&start) },
            });
        }

        let mut end = Vec::new();
        file.seek(SeekFrom::Start(size.saturating_sub(magic).max(magic))).map_err(io)?;
        file.by_ref().take(magic).read_to_end(&mut end).map_err(io)?;
        file.seek(SeekFrom::Start(magic)).map_err(io)?;
        let is_finished = end == MAGIC;
        Ok(Self {
            file,
            size,
            is_finished,
            all,
            next: magic,
            byte: magic,
            chunk: None,
            opcode: 0,
            body: Vec::new(),
            messages: 0,
            is_over: false,
        })
    }

    /// The size of the file in bytes.
    pub(crate) fn size(&self) -> u64 {
        self.size
    }

    /// The file itself, to read elsewhere in it; reading cannot be resumed afterwards.
    pub(crate) fn into_file(self) -> BufReader<File> {
        self.file
    }

    /// Returns the byte at which the current record starts, or the chunk it is in.
    pub(crate) fn byte(&self) -> u64 {
        self.byte
    }

    /// The current record.
    pub(crate) fn record(&self) -> Result<Record<'_>, RecordingErrorKind> {
        Record::parse(self.opcode, &self.body)
            .ok_or_else(|| self.corrupt(format!("a {} record is malformed", Record::kind(self.opcode))))
    }

    /// The error for a fault in the current record.
    pub(crate) fn corrupt(&self, fault: impl Into<String>) -> RecordingErrorKind {
        RecordingErrorKind::Corrupt { messages: self.messages, byte: self.byte, fault: fault.into() }
    }

    /// Steps to the next wanted record; returns false at the end of the data. After an error there is nothing more.
    pub(crate) fn advance(&mut self) -> Result<bool, RecordingErrorKind> {
        if self.is_over {
            return Ok(false);
        }
        if self.opcode == op::MESSAGE {
            self.messages += 1;
        }
        self.opcode = 0;
        let found = self.find();
        self.is_over = !matches!(found, Ok(true));
        found
    }

    fn find(&mut self) -> Result<bool, RecordingErrorKind> {
        loop {
            let opcode = match &mut self.chunk {
                Some(chunk) => match chunk.next(&mut self.body) {
                    Ok(Some(opcode)) => opcode,
                    Ok(None) => {
                        self.chunk = None;
                        continue;
                    }
                    Err(fault) => return Err(self.chunk_fault(fault)),
                },
                None => match self.step()? {
                    // Only the records at the end of a complete file show that nothing is missing after it.
                    (op::DATA_END | op::FOOTER, _) if !self.is_finished => return Err(self.overrun()),
                    (op::DATA_END | op::FOOTER, _) => return Ok(false),
                    (op::CHUNK, is_whole) => {
                        let chunk = Chunk::open(&self.body, is_whole);
                        self.chunk = Some(chunk.map_err(|fault| self.chunk_fault(fault))?);
                        continue;
                    }
                    (opcode, _) => opcode,
                },
            };
            if self.wants(opcode) {
                self.opcode = opcode;
                return Ok(true);
            }
        }
    }

    fn wants(&self, opcode: u8) -> bool {
        match opcode {
            op::SCHEMA | op::CHANNEL | op::MESSAGE => true,
            op::HEADER | op::METADATA | op::ATTACHMENT => self.all,
            _ => false,
        }
    }

    /// Reads the next record of the file and returns its kind, and whether it is complete: only a chunk may be
    /// incomplete. The body is read only for wanted kinds.
    fn step(&mut self) -> Result<(u8, bool), RecordingErrorKind> {
        self.byte = self.next;
        let left = self.size.saturating_sub(self.next);
        if left < FRAME as u64 {
            return Err(self.overrun());
        }
        let mut frame = [0; FRAME];
        self.file.read_exact(&mut frame).map_err(|error| self.io(error))?;
        let (opcode, length) = unframe(frame);
        let left = left - FRAME as u64;
        let is_whole = length <= left;
        if !is_whole && (opcode != op::CHUNK || self.is_finished) {
            return Err(self.overrun());
        }
        self.next = self.next.saturating_add(FRAME as u64).saturating_add(length);
        if !self.wants(opcode) && opcode != op::CHUNK {
            self.file.seek(SeekFrom::Start(self.next)).map_err(|error| self.io(error))?;
            return Ok((opcode, true));
        }
        if length.min(left) > LIMIT {
            return Err(self.too_large(length));
        }
        self.body.clear();
        let read = self.file.by_ref().take(length).read_to_end(&mut self.body).map_err(|error| self.io(error))?;
        if is_whole && (read as u64) < length {
            return Err(self.overrun());
        }
        Ok((opcode, is_whole))
    }

    fn chunk_fault(&self, fault: ChunkFault) -> RecordingErrorKind {
        match fault {
            ChunkFault::Ends => self.overrun(),
            ChunkFault::Corrupt(fault) => self.corrupt(fault),
            ChunkFault::TooLarge(length) => self.too_large(length),
            ChunkFault::Compression(compression) => {
                RecordingErrorKind::Compression { byte: self.byte, compression }
            }
        }
    }

    fn too_large(&self, length: u64) -> RecordingErrorKind {
        RecordingErrorKind::TooLarge { messages: self.messages, byte: self.byte, length, limit: LIMIT }
    }

    /// The error for a record that the file is too short for.
    fn overrun(&self) -> RecordingErrorKind {
        match self.is_finished {
            true => self.corrupt("a record runs over the end of the file"),
            false => RecordingErrorKind::Truncated { messages: self.messages, byte: self.byte, size: self.size },
        }
    }

    fn io(&self, cause: io::Error) -> RecordingErrorKind {
        match cause.kind() {
            // The file has become shorter since it was opened.
            io::ErrorKind::UnexpectedEof => self.overrun(),
            _ => RecordingErrorKind::Read { byte: self.byte, cause },
        }
    }
}

/// The likely format of a file that is not MCAP, by its first bytes, and what to do with it.
const OTHERS: [(&[u8], &str); 10] = [
    (
        b"SQLite format 3",
        "it is an SQLite database; if it is a ROS 2 bag, build with the feature `sqlite`, or convert it with `ros2 bag \
         convert`, or with `rosbags-convert --src BAG --dst NEW --dst-storage mcap`",
    ),
    (b"#ROSBAG", "it is a ROS 1 bag; convert it with `bb convert BAG NEW.mcap`"),
    (&[0x28, 0xb5, 0x2f, 0xfd], "it is packed as a whole with zstd; unpack it with `zstd -d`"),
    (&[0x1f, 0x8b], "it is packed as a whole with gzip; unpack it with `gunzip`"),
    (&[0x04, 0x22, 0x4d, 0x18], "it is packed as a whole with lz4; unpack it with `lz4 -d`"),
    (b"PK\x03\x04", "it is a zip archive; unpack it"),
    (b"ULog", "it is a log of PX4; convert it with `bb convert LOG NEW.mcap`"),
    (b"MATLAB", "it is a MATLAB file; make CSV of it, and a bag of that with `bb convert`"),
    (b"\x89HDF", "it is an HDF5 file; make CSV of it, and a bag of that with `bb convert`"),
    (b"version https://", "it is a pointer of Git LFS; fetch the file itself with `git lfs pull`"),
];

fn guess(start: &[u8]) -> &'static str {
    let is_text = || start.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace());
    match OTHERS.iter().find(|(magic, _)| start.starts_with(magic)) {
        Some((_, found)) => found,
        None if is_text() => "it is text; if it is CSV, make a bag of it with `bb convert`",
        None => "it does not start with MCAP's magic bytes; record or convert with storage `mcap`",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_formats_are_recognised() {
        assert!(guess(b"SQLite format 3\0").contains("ros2 bag"));
        assert!(guess(b"#ROSBAG V2.0\n").contains("ROS 1"));
        assert!(guess(b"\x1f\x8b\x08").contains("gunzip"));
        assert!(guess(b"version https://git-lfs").contains("git lfs pull"));
        assert!(guess(b"t,x,y\r\n0,1,2").contains("bb convert"));
        assert!(guess(b"\x00\xff").contains("magic"));
    }
}
