//! The relevant records, parsed by hand: mcap's parser panics on some malformed ones.

use super::fields::Fields;
use mcap::records::op;
use std::collections::BTreeMap;

/// A record, without its frame.
#[derive(Debug)]
pub(crate) enum Record<'a> {
    Header {
        profile: &'a str,
        library: &'a str,
    },
    Schema {
        id: u16,
        name: &'a str,
        encoding: &'a str,
        data: &'a [u8],
    },
    Channel {
        id: u16,
        schema: u16,
        topic: &'a str,
        encoding: &'a str,
        metadata: BTreeMap<String, String>,
    },
    Message {
        channel: u16,
        sequence: u32,
        log_time: u64,
        publish_time: u64,
        data: &'a [u8],
    },
    Metadata {
        name: &'a str,
        metadata: BTreeMap<String, String>,
    },
    Attachment {
        log_time: u64,
        create_time: u64,
        name: &'a str,
        media_type: &'a str,
        data: &'a [u8],
    },
    /// The number of messages of each channel, from the summary.
    Statistics {
        channels: u32,
        messages: BTreeMap<u16, u64>,
    },
}

impl<'a> Record<'a> {
    /// The name of a kind that [`parse`](Self::parse) knows, for faults.
    pub(crate) fn kind(opcode: u8) -> &'static str {
        match opcode {
            op::HEADER => "header",
            op::SCHEMA => "schema",
            op::CHANNEL => "channel",
            op::MESSAGE => "message",
            op::METADATA => "metadata",
            op::ATTACHMENT => "attachment",
            op::STATISTICS => "statistics",
            _ => "unknown",
        }
    }

    /// The record of this kind with these bytes; `None` if they are malformed.
    pub(crate) fn parse(opcode: u8, body: &'a [u8]) -> Option<Self> {
        let mut fields = Fields(body);
        match opcode {
            op::HEADER => Some(Self::Header { profile: fields.text()?, library: fields.text()? }),
            op::SCHEMA => {
                let id = fields.u16()?;
                let name = fields.text()?;
                let encoding = fields.text()?;
                Some(Self::Schema { id, name, encoding, data: fields.bytes()? })
            }
            op::CHANNEL => {
                let id = fields.u16()?;
                let schema = fields.u16()?;
                let topic = fields.text()?;
                let encoding = fields.text()?;
                Some(Self::Channel { id, schema, topic, encoding, metadata: fields.map()? })
            }
            op::MESSAGE => {
                let channel = fields.u16()?;
                let sequence = fields.u32()?;
                let log_time = fields.u64()?;
                let publish_time = fields.u64()?;
                Some(Self::Message { channel, sequence, log_time, publish_time, data: fields.0 })
            }
            op::METADATA => Some(Self::Metadata { name: fields.text()?, metadata: fields.map()? }),
            op::ATTACHMENT => {
                let log_time = fields.u64()?;
                let create_time = fields.u64()?;
                let name = fields.text()?;
                let media_type = fields.text()?;
                let length = fields.u64()?;
                Some(Self::Attachment { log_time, create_time, name, media_type, data: fields.take(length)? })
            }
            op::STATISTICS => {
                let _messages = fields.u64()?;
                let _schemas = fields.u16()?;
                let channels = fields.u32()?;
                let _attachments = fields.u32()?;
                let _metadata = fields.u32()?;
                let _chunks = fields.u32()?;
                let _start = fields.u64()?;
                let _end = fields.u64()?;
                Some(Self::Statistics { channels, messages: fields.counts()? })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_by_hand() {
        let mut body = vec![2, 0, 9, 0, 0, 0];
        body.extend(77u64.to_le_bytes());
        body.extend(78u64.to_le_bytes());
        for end in 0..body.len() {
            assert!(Record::parse(op::MESSAGE, &body[..end]).is_none());
        }
        body.push(5);
        let message = Record::parse(op::MESSAGE, &body).expect("whole");
        let Record::Message { channel: 2, sequence: 9, log_time: 77, publish_time: 78, data: [5] } = message else {
            panic!("{message:?}");
        };
    }
}
