//! The records of a file one after the other, those inside chunks included, up to the end or the break.
//!
//! The file is framed here rather than by mcap, so that a length is compared with the file before anything is allocated
//! for it, and a chunk that breaks off is read as far as it goes. mcap unpacks the chunks.

use crate::bytes::Fields;
use crate::error::RecordingErrorKind;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// The longest record or unpacked chunk that is taken, in bytes: what exceeds this by far is damage.
const LIMIT: u64 = 256 << 20;

/// Every record starts with its kind and its length.
const FRAME: usize = 1 + 8;

/// A record that matters.
#[derive(Clone, Debug)]
pub(crate) enum Record {
    Header { profile: String, library: String },
    Schema { id: u16, name: String, encoding: String, data: Vec<u8> },
    Channel { id: u16, schema: u16, topic: String, encoding: String, metadata: BTreeMap<String, String> },
    Message { channel: u16, sequence: u32, log_time: u64, publish_time: u64, data: Vec<u8> },
    Metadata { name: String, metadata: BTreeMap<String, String> },
    Attachment { log_time: u64, create_time: u64, name: String, media_type: String, data: Vec<u8> },
}

/// A file, and where in it the reading is.
pub(crate) struct Records {
    file: BufReader<File>,
    size: u64,
    /// Where the next record of the file starts.
    next: u64,
    /// Where the current record starts, or the chunk it is in.
    byte: u64,
    chunk: Option<Chunk>,
    messages: u64,
    /// After the end, and after the break.
    is_over: bool,
}

/// A chunk, or as much of it as there is.
enum Chunk {
    Plain { data: Vec<u8>, at: usize, is_whole: bool },
    Packed { reader: Box<LinearReader>, is_whole: bool },
}

impl Records {
    pub(crate) fn open(path: &Path) -> Result<Self, RecordingErrorKind> {
        let about = std::fs::metadata(path).map_err(RecordingErrorKind::Read)?;
        if !about.is_file() {
            return Err(RecordingErrorKind::NotMcap);
        }
        let mut file = BufReader::new(File::open(path).map_err(RecordingErrorKind::Read)?);
        let mut start = Vec::new();
        let magic = MAGIC.len() as u64;
        file.by_ref().take(magic).read_to_end(&mut start).map_err(RecordingErrorKind::Read)?;
        if start != MAGIC {
            return Err(RecordingErrorKind::NotMcap);
        }
        let size = about.len();
        Ok(Self { file, size, next: magic, byte: magic, chunk: None, messages: 0, is_over: false })
    }

    /// The next record that matters; none at the end. After an error there is nothing more.
    pub(crate) fn advance(&mut self) -> Result<Option<Record>, RecordingErrorKind> {
        if self.is_over {
            return Ok(None);
        }
        let record = self.find();
        match &record {
            Ok(Some(Record::Message { .. })) => self.messages += 1,
            Ok(Some(_)) => {}
            Ok(None) | Err(_) => self.is_over = true,
        }
        record
    }

    /// That the file is wrong where the reading is.
    pub(crate) fn broken(&self, fault: impl Into<String>) -> RecordingErrorKind {
        RecordingErrorKind::Broken { byte: self.byte, messages: self.messages, fault: fault.into() }
    }

    fn find(&mut self) -> Result<Option<Record>, RecordingErrorKind> {
        loop {
            let (opcode, body) = match &mut self.chunk {
                Some(chunk) => match chunk.next() {
                    Ok(Some(record)) => record,
                    Ok(None) => {
                        self.chunk = None;
                        continue;
                    }
                    Err(fault) => return Err(self.broken(fault)),
                },
                None => match self.step()? {
                    Some((op::CHUNK, body, is_whole)) => {
                        self.chunk = Some(unpack(body, is_whole).map_err(|fault| self.broken(fault))?);
                        continue;
                    }
                    Some((opcode, body, _)) => (opcode, body),
                    None => return Ok(None),
                },
            };
            match parse(opcode, &body) {
                Parsed::Record(record) => return Ok(Some(record)),
                Parsed::Skip => {}
                Parsed::Malformed => return Err(self.broken("a record is malformed")),
            }
        }
    }

    /// The next record of the file, and whether it is whole; one that is not must be a chunk. None at the end.
    fn step(&mut self) -> Result<Option<(u8, Vec<u8>, bool)>, RecordingErrorKind> {
        loop {
            self.byte = self.next;
            let left = self.size.saturating_sub(self.next);
            if left < FRAME as u64 {
                return Err(self.broken("it breaks off"));
            }
            let mut frame = [0; FRAME];
            self.file.read_exact(&mut frame).map_err(|error| self.io(error))?;
            let [opcode, length @ ..] = frame;
            let (length, left) = (u64::from_le_bytes(length), left - FRAME as u64);
            let is_whole = length <= left;
            self.next = self.next.saturating_add(FRAME as u64).saturating_add(length);
            match opcode {
                op::DATA_END => {
                    // Only what a whole file ends with tells that nothing is missing behind.
                    return if self.has_end() { Ok(None) } else { Err(self.broken("it breaks off at its end")) };
                }
                op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA | op::ATTACHMENT | op::CHUNK => {
                    if !is_whole && opcode != op::CHUNK {
                        return Err(self.broken("it breaks off"));
                    }
                    if length.min(left) > LIMIT {
                        return Err(self.broken(format!("a record has {length} bytes, more than {LIMIT}")));
                    }
                    let mut body = Vec::new();
                    let read =
                        self.file.by_ref().take(length).read_to_end(&mut body).map_err(|error| self.io(error))?;
                    return Ok(Some((opcode, body, read as u64 == length)));
                }
                _ if !is_whole => return Err(self.broken("it breaks off")),
                _ => _ = self.file.seek(SeekFrom::Start(self.next)).map_err(|error| self.io(error))?,
            }
        }
    }

    fn has_end(&mut self) -> bool {
        let mut end = [0; MAGIC.len()];
        let from = self.size.saturating_sub(MAGIC.len() as u64);
        let read = self.file.seek(SeekFrom::Start(from)).and_then(|_| self.file.read_exact(&mut end));
        read.is_ok() && end == MAGIC
    }

    fn io(&self, error: io::Error) -> RecordingErrorKind {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => self.broken("it breaks off"),
            _ => RecordingErrorKind::Read(error),
        }
    }
}

impl Chunk {
    fn next(&mut self) -> Result<Option<(u8, Vec<u8>)>, String> {
        match self {
            Self::Plain { data, at, is_whole } => {
                let Some(rest) = data.get(*at..).filter(|rest| !rest.is_empty()) else {
                    return if *is_whole { Ok(None) } else { Err("it breaks off in a chunk".into()) };
                };
                let record = split(rest).ok_or("a chunk breaks off in a record")?;
                *at += FRAME + record.1.len();
                Ok(Some((record.0, record.1.to_vec())))
            }
            Self::Packed { reader, is_whole } => loop {
                match reader.next_event() {
                    Some(Ok(LinearReadEvent::Record { opcode, data })) => return Ok(Some((opcode, data.to_vec()))),
                    // It has got all there is.
                    Some(Ok(LinearReadEvent::ReadRequest(_))) => reader.notify_read(0),
                    Some(Err(McapError::UnexpectedEof)) if !*is_whole => {
                        return Err("it breaks off in a chunk".into());
                    }
                    Some(Err(error)) => return Err(format!("a chunk is damaged ({error})")),
                    None => return Ok(None),
                }
            },
        }
    }
}

fn split(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let mut fields = Fields(bytes);
    let [opcode] = fields.number::<1>()?;
    let length = fields.u64()?;
    Some((opcode, fields.take(length)?))
}

fn unpack(body: Vec<u8>, is_whole: bool) -> Result<Chunk, String> {
    let malformed = "the head of a chunk is malformed";
    let mut fields = Fields(&body);
    let (_, _, unpacked) =
        fields.u64().zip(fields.u64()).zip(fields.u64()).map(|((a, b), c)| (a, b, c)).ok_or(malformed)?;
    fields.u32().ok_or(malformed)?;
    let compression = fields.text().ok_or(malformed)?;
    let packed = fields.u64().ok_or(malformed)?;
    match compression.as_str() {
        "" => {
            let length = packed.min(fields.0.len() as u64);
            let data = fields.take(length).ok_or(malformed)?.to_vec();
            Ok(Chunk::Plain { data, at: 0, is_whole })
        }
        "lz4" | "zstd" if unpacked <= LIMIT => {
            let longest = body.len().max(usize::try_from(unpacked).unwrap_or(usize::MAX));
            let options = LinearReaderOptions::default()
                .with_skip_start_magic(true)
                .with_skip_end_magic(true)
                // The checksum of what breaks off is unknown.
                .with_prevalidate_chunk_crcs(is_whole)
                .with_record_length_limit(longest);
            let mut reader = Box::new(LinearReader::new_with_options(options));
            // What is not there is announced, so that mcap takes it for what breaks off.
            let head = body.len() - fields.0.len();
            let length = if is_whole { body.len() as u64 } else { (head as u64).saturating_add(packed) };
            let room = reader.insert(FRAME + body.len());
            room[0] = op::CHUNK;
            room[1..FRAME].copy_from_slice(&length.to_le_bytes());
            room[FRAME..FRAME + body.len()].copy_from_slice(&body);
            reader.notify_read(FRAME + body.len());
            Ok(Chunk::Packed { reader, is_whole })
        }
        "lz4" | "zstd" => Err(format!("a chunk has {unpacked} bytes, more than {LIMIT}")),
        other => Err(format!("a chunk is packed as `{other}`, not as `lz4` or `zstd`")),
    }
}

enum Parsed {
    Record(Record),
    Skip,
    Malformed,
}

fn parse(opcode: u8, body: &[u8]) -> Parsed {
    let mut fields = Fields(body);
    let record = match opcode {
        op::HEADER => header(&mut fields),
        op::SCHEMA => schema(&mut fields),
        op::CHANNEL => channel(&mut fields),
        op::MESSAGE => message(&mut fields),
        op::METADATA => metadata(&mut fields),
        op::ATTACHMENT => attachment(&mut fields),
        _ => return Parsed::Skip,
    };
    record.map_or(Parsed::Malformed, Parsed::Record)
}

fn header(fields: &mut Fields<'_>) -> Option<Record> {
    Some(Record::Header { profile: fields.text()?, library: fields.text()? })
}

fn schema(fields: &mut Fields<'_>) -> Option<Record> {
    let (id, name, encoding) = (fields.u16()?, fields.text()?, fields.text()?);
    Some(Record::Schema { id, name, encoding, data: fields.bytes()?.to_vec() })
}

fn channel(fields: &mut Fields<'_>) -> Option<Record> {
    let (id, schema, topic, encoding) = (fields.u16()?, fields.u16()?, fields.text()?, fields.text()?);
    Some(Record::Channel { id, schema, topic, encoding, metadata: fields.map()? })
}

fn message(fields: &mut Fields<'_>) -> Option<Record> {
    let (channel, sequence) = (fields.u16()?, fields.u32()?);
    let (log_time, publish_time) = (fields.u64()?, fields.u64()?);
    Some(Record::Message { channel, sequence, log_time, publish_time, data: fields.0.to_vec() })
}

fn metadata(fields: &mut Fields<'_>) -> Option<Record> {
    Some(Record::Metadata { name: fields.text()?, metadata: fields.map()? })
}

fn attachment(fields: &mut Fields<'_>) -> Option<Record> {
    let (log_time, create_time) = (fields.u64()?, fields.u64()?);
    let (name, media_type, length) = (fields.text()?, fields.text()?, fields.u64()?);
    let data = fields.take(length)?.to_vec();
    Some(Record::Attachment { log_time, create_time, name, media_type, data })
}
