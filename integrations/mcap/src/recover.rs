//! Makes a complete file of the part of a damaged one before the damage.

use crate::error::{create_error, write_error};
use crate::file::{Record, Records};
use crate::{RecorderOptions, RecordingError};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapError, McapResult, Writer};
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The result of [`recover`].
#[derive(Debug)]
#[non_exhaustive]
pub struct Recovered {
    /// The number of messages.
    pub messages: u64,
    /// Place and cause of the damage; `None` if the file was complete.
    pub broken: Option<RecordingError>,
}

/// Writes everything before the damage in `broken` to a new, complete file `repaired`. It need not be a recording of
/// this crate: any MCAP file will do.
///
/// # Errors
/// `broken` cannot be read at all, or `repaired` exists or cannot be written.
pub fn recover(broken: impl AsRef<Path>, repaired: impl AsRef<Path>) -> Result<Recovered, RecordingError> {
    let (broken, repaired) = (broken.as_ref(), repaired.as_ref());
    let fail_to_read = |kind| RecordingError::new(broken, kind);
    let mut records = Records::open_all(broken).map_err(fail_to_read)?;
    let mut options = RecorderOptions::default().mcap();
    let mut next = records.advance();
    if let Ok(true) = next
        && let Ok(Record::Header { profile, library }) = records.record()
    {
        options = options.profile(profile).library(library);
        next = records.advance();
    }
    let file = File::create_new(repaired).map_err(|cause| RecordingError::new(repaired, create_error(cause)))?;
    let fail = |error| RecordingError::new(repaired, write_error(0, error));
    let mut writer = options.create(BufWriter::new(file)).map_err(fail)?;
    let mut messages = 0;
    let end = loop {
        match next.and_then(|is_one| is_one.then(|| records.record()).transpose()) {
            Ok(Some(record)) => {
                let is_message = matches!(record, Record::Message { .. });
                match write(&mut writer, record) {
                    Ok(()) => messages += u64::from(is_message),
                    Err(error @ (McapError::Io(_) | McapError::AttemptedWriteAfterFailure)) => {
                        return Err(fail(error));
                    }
                    // For example a message without a channel: damage.
                    Err(error) => break Some(records.corrupt(error.to_string())),
                }
                next = records.advance();
            }
            Ok(None) => break None,
            Err(kind) => break Some(kind),
        }
    };
    writer.finish().map_err(fail)?;
    let flushed = writer.into_inner().flush();
    flushed.map_err(|error| fail(error.into()))?;
    Ok(Recovered { messages, broken: end.map(fail_to_read) })
}

fn write(writer: &mut Writer<BufWriter<File>>, record: Record<'_>) -> McapResult<()> {
    match record {
        Record::Header { .. } | Record::Statistics { .. } => Ok(()),
        Record::Schema { id, name, encoding, data } => {
            writer.add_schema_with_id(id, name, encoding, data).map(drop)
        }
        Record::Channel { id, schema, topic, encoding, metadata } => {
            writer.add_channel_with_id(id, schema, topic, encoding, &metadata).map(drop)
        }
        Record::Message { channel, sequence, log_time, publish_time, data } => {
            let header = MessageHeader { channel_id: channel, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, data)
        }
        Record::Metadata { name, metadata } => writer.write_metadata(&Metadata { name: name.to_owned(), metadata }),
        Record::Attachment { log_time, create_time, name, media_type, data } => writer.attach(&Attachment {
            log_time,
            create_time,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(data),
        }),
    }
}
