//! The summary at the end of a finished bag: its topics without reading its messages.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};

use super::{Topic, topics_of};
use crate::file::{Channels, FRAME, LIMIT, Record, unframe};
use mcap::MAGIC;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

/// The footer: where the summary starts, where its offsets start, a checksum.
const FOOTER: usize = 8 + 8 + 4;

/// The topics from the summary, if it is complete, matches its checksum and repeats the channels. Anything else is
/// not an error: reading the messages gives the same, only later.
///
/// mcap has a reader for this, which can panic on a damaged summary.
pub(crate) fn topics(mut file: BufReader<File>, size: u64) -> Option<Vec<Topic>> {
    let tail = (FRAME + FOOTER + MAGIC.len()) as u64;
    let footer = size.checked_sub(tail)?;
    file.seek(SeekFrom::Start(footer)).ok()?;
    let mut frame = [0; FRAME];
    file.read_exact(&mut frame).ok()?;
    let mut start = [0; 8];
    file.read_exact(&mut start).ok()?;
    let start = u64::from_le_bytes(start);
    // A start of zero means that there is none.
    if unframe(frame) != (op::FOOTER, FOOTER as u64) || start < MAGIC.len() as u64 || start > footer {
        return None;
    }
    file.seek(SeekFrom::Start(start)).ok()?;
    let length = size - start;
    if length > LIMIT {
        return None;
    }

    let mut reader = LinearReader::new_with_options(
        LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_emit_chunks(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(usize::try_from(length).ok()?),
    );
    // The reader computes the checksum of the bytes after the record that ends the data, so it is given one.
    let data_end: [u8; FRAME + 4] = [op::DATA_END, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    reader.insert(data_end.len()).copy_from_slice(&data_end);
    reader.notify_read(data_end.len());

    let mut file = file.take(length);
    let mut channels = Channels::default();
    let mut counts = None;
    let mut empty = false;
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            LinearReadEvent::ReadRequest(wanted) => {
                let wanted = (wanted as u64).min(file.limit()) as usize;
                let got = file.read(reader.insert(wanted)).ok()?;
                reader.notify_read(got);
            }
            LinearReadEvent::Record { opcode: opcode @ (op::STATISTICS | op::SCHEMA | op::CHANNEL), data } => {
                match Record::parse(opcode, data)? {
                    Record::Statistics { channels, messages } => {
                        empty = channels == 0;
                        counts = Some(messages);
                    }
                    other => _ = channels.define(other).ok()?,
                }
            }
            LinearReadEvent::Record { .. } => {}
        }
    }
    let topics = topics_of(&channels, counts.as_ref());
    // A summary need not repeat the channels.
    (empty || !topics.is_empty()).then_some(topics)
}
