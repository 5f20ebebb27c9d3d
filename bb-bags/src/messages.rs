//! The messages of chosen topics, one by one.

use std::collections::HashMap;
use std::fmt;
use std::iter::FusedIterator;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::op;

use crate::channels::Channels;
use crate::error::{BagError, BagErrorKind};
use crate::records::Records;
use crate::ros::{self, Decode, RosMessage};

/// One message of a bag.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Message {
    /// The topic it was published on; the same allocation for every message of the topic.
    pub topic: Arc<str>,
    /// When the recorder received it, in nanoseconds of the recorder's clock, mostly since 1970. When its values
    /// held is in the header.
    pub log_time_ns: u64,
    /// What it says.
    pub payload: RosMessage,
}

/// The messages of chosen topics in the order of the file; see [`Bag::messages`](crate::Bag::messages).
///
/// After an error there is nothing more.
pub struct Messages {
    path: PathBuf,
    /// `None` once it is over, which closes the file.
    records: Option<Records>,
    channels: Channels,
    wanted: Vec<Wanted>,
    /// What to do with the messages of each channel met so far; `None` for those nobody wants.
    routes: HashMap<u16, Option<Route>>,
}

/// A topic that was chosen.
#[derive(Debug)]
pub(crate) struct Wanted {
    pub(crate) topic: Arc<str>,
    /// How many messages there are at least, by the summary.
    pub(crate) expected: u64,
    /// How many there have been.
    pub(crate) count: u64,
}

/// How the messages of one channel are read.
#[derive(Clone)]
struct Route {
    /// Index into the wanted topics.
    topic: usize,
    schema: Arc<str>,
    decode: Decode,
}

impl Messages {
    pub(crate) fn open(path: &Path, wanted: Vec<Wanted>) -> Result<Self, BagError> {
        let records = Records::open(path).map_err(|kind| BagError::new(path, kind))?;
        Ok(Self {
            path: path.to_owned(),
            records: Some(records).filter(|_| !wanted.is_empty()),
            channels: Channels::default(),
            wanted,
            routes: HashMap::new(),
        })
    }

    fn step(&mut self) -> Result<Option<Message>, BagErrorKind> {
        let Some(records) = &mut self.records else {
            return Ok(None);
        };
        while let Some(opcode) = records.advance()? {
            if opcode != op::MESSAGE {
                self.channels.define(opcode, records.body()).map_err(|fault| records.corrupt(fault))?;
                continue;
            }
            let RawMessage { channel, log_time_ns, payload } = RawMessage::parse(records)?;
            let route = match self.routes.get(&channel) {
                Some(route) => route,
                None => {
                    let route = match self.channels.get(channel) {
                        None => {
                            return Err(records.corrupt(format!("a message of the unknown channel {channel}")));
                        }
                        Some(c) => match self.wanted.iter().position(|w| w.topic == c.topic) {
                            None => None,
                            Some(topic) => {
                                let decode = check(&c.topic, &c.schema, &c.encoding)?;
                                Some(Route { topic, schema: c.schema.clone(), decode })
                            }
                        },
                    };
                    self.routes.entry(channel).or_insert(route)
                }
            };
            let Some(route) = route else { continue };
            let Wanted { topic, count, .. } = &mut self.wanted[route.topic];
            *count += 1;
            let payload = (route.decode)(payload).map_err(|fault| BagErrorKind::Payload {
                topic: topic.to_string(),
                schema: route.schema.to_string(),
                message: *count,
                log_time_ns,
                byte: records.byte(),
                fault,
            })?;
            return Ok(Some(Message { topic: topic.clone(), log_time_ns, payload }));
        }
        // The length of a chunk and that it is one are covered by no checksum. Damage there can hide the chunk, and
        // only the summary knows.
        match self.wanted.iter().find(|w| w.count < w.expected) {
            Some(Wanted { topic, expected, count }) => {
                Err(records.corrupt(format!("it ends with {count} of the {expected} messages on {topic}")))
            }
            None => Ok(None),
        }
    }
}

impl Iterator for Messages {
    type Item = Result<Message, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        let item = self.step().map_err(|kind| BagError::new(&self.path, kind)).transpose();
        if !matches!(item, Some(Ok(_))) {
            self.records = None;
        }
        item
    }
}

impl FusedIterator for Messages {}

impl fmt::Debug for Messages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let at = self.records.as_ref().map(Records::byte);
        f.debug_struct("Messages")
            .field("path", &self.path)
            .field("topics", &self.wanted)
            .field("byte", &at)
            .finish_non_exhaustive()
    }
}

/// How to read messages of this topic, if they can be read.
pub(crate) fn check(topic: &str, schema: &str, encoding: &str) -> Result<Decode, BagErrorKind> {
    if encoding != "cdr" {
        return Err(BagErrorKind::Encoding { topic: topic.into(), encoding: encoding.into() });
    }
    ros::decoder(schema).ok_or_else(|| BagErrorKind::UnknownType {
        topic: topic.into(),
        schema: if schema.is_empty() { "of no given type".into() } else { schema.into() },
        known: ros::known(),
    })
}

/// A message record. Taken apart by hand: it is the hot path, and only two of its fields are wanted.
pub(crate) struct RawMessage<'a> {
    pub(crate) channel: u16,
    pub(crate) log_time_ns: u64,
    pub(crate) payload: &'a [u8],
}

impl<'a> RawMessage<'a> {
    /// The current record as a message.
    pub(crate) fn parse(records: &'a Records) -> Result<Self, BagErrorKind> {
        Self::from_bytes(records.body())
            .ok_or_else(|| records.corrupt("a message record is too short for its head"))
    }

    fn from_bytes(body: &'a [u8]) -> Option<Self> {
        let (channel, rest) = body.split_first_chunk()?;
        let (_sequence, rest) = rest.split_first_chunk::<4>()?;
        let (log_time, rest) = rest.split_first_chunk()?;
        let (_publish_time, payload) = rest.split_first_chunk::<8>()?;
        let (channel, log_time_ns) = (u16::from_le_bytes(*channel), u64::from_le_bytes(*log_time));
        Some(Self { channel, log_time_ns, payload })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_iterator_can_go_to_another_thread() {
        fn check<T: Send + 'static>() {}
        check::<Messages>();
        check::<Message>();
    }

    #[test]
    fn a_message_record_by_hand() {
        let mut body = vec![2, 0, 9, 0, 0, 0];
        body.extend(77u64.to_le_bytes());
        body.extend(78u64.to_le_bytes());
        for end in 0..body.len() {
            assert!(RawMessage::from_bytes(&body[..end]).is_none());
        }
        body.push(5);
        let message = RawMessage::from_bytes(&body).expect("whole");
        assert_eq!((message.channel, message.log_time_ns, message.payload), (2, 77, &[5][..]));
    }

    #[test]
    fn what_cannot_be_read_is_refused_beforehand() {
        assert!(check("/imu", "sensor_msgs/msg/Imu", "cdr").is_ok());
        let said = check("/imu", "sensor_msgs/msg/Imu", "ros1").unwrap_err().to_string();
        assert!(said.starts_with("the messages of /imu are encoded as `ros1`"), "{said}");
        let said = check("/scan", "sensor_msgs/msg/LaserScan", "cdr").unwrap_err().to_string();
        assert!(said.contains("sensor_msgs/msg/LaserScan, which is not read"), "{said}");
    }
}
