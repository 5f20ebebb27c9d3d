//! The schemas and channels a bag defines as it goes along.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use mcap::records::{Record, op};

use crate::bag::Topic;
use crate::ros;

/// A stream of messages of one topic; a topic may have several, one for each publisher.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) topic: Arc<str>,
    /// The full name of the type; empty if the bag gives none.
    pub(crate) schema: Arc<str>,
    pub(crate) encoding: String,
}

/// All channels met so far.
#[derive(Debug, Default)]
pub(crate) struct Channels {
    schemas: HashMap<u16, Arc<str>>,
    channels: BTreeMap<u16, Channel>,
}

impl Channels {
    /// Takes in a schema or channel record; others are none of its business. The error says what is wrong.
    pub(crate) fn define(&mut self, opcode: u8, body: &[u8]) -> Result<(), String> {
        // Only these two are ever parsed: mcap's parser panics on some malformed records of other kinds.
        if !matches!(opcode, op::SCHEMA | op::CHANNEL) {
            return Ok(());
        }
        match mcap::parse_record(opcode, body) {
            Ok(Record::Schema { header, .. }) => {
                let name: Arc<str> = ros::full_name(&header.name).into();
                match self.schemas.insert(header.id, name.clone()) {
                    Some(old) if old != name => Err(format!("schema {} is both {old} and {name}", header.id)),
                    _ => Ok(()),
                }
            }
            Ok(Record::Channel(channel)) => {
                let schema = match self.schemas.get(&channel.schema_id) {
                    Some(name) => name.clone(),
                    None if channel.schema_id == 0 => "".into(),
                    None => {
                        return Err(format!("{} has the unknown schema {}", channel.topic, channel.schema_id));
                    }
                };
                let topic = channel.topic.into();
                let new = Channel { topic, schema, encoding: channel.message_encoding };
                let topic = new.topic.clone();
                match self.channels.insert(channel.id, new.clone()) {
                    Some(old) if old != new => {
                        Err(format!("channel {} is defined twice, for {} and {topic}", channel.id, old.topic))
                    }
                    _ => Ok(()),
                }
            }
            Ok(_) => Ok(()),
            Err(_) if opcode == op::SCHEMA => Err("a schema record is malformed".into()),
            Err(_) => Err("a channel record is malformed".into()),
        }
    }

    pub(crate) fn get(&self, id: u16) -> Option<&Channel> {
        self.channels.get(&id)
    }

    /// The topics of these channels, with how many messages each has if `counts` (by channel) are known.
    pub(crate) fn topics(&self, counts: Option<&BTreeMap<u16, u64>>) -> Vec<Topic> {
        let mut topics: Vec<Topic> = Vec::new();
        for (id, channel) in &self.channels {
            let count = counts.map(|counts| counts.get(id).copied().unwrap_or(0));
            let same = |t: &&mut Topic| {
                t.name == channel.topic && t.schema == channel.schema && t.encoding == channel.encoding
            };
            if let Some(topic) = topics.iter_mut().find(same) {
                topic.messages = topic.messages.zip(count).map(|(a, b)| a.saturating_add(b));
            } else {
                topics.push(Topic {
                    name: channel.topic.clone(),
                    schema: channel.schema.clone(),
                    encoding: channel.encoding.clone(),
                    messages: count,
                });
            }
        }
        topics
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(bytes: &mut Vec<u8>, text: &str) {
        bytes.extend((text.len() as u32).to_le_bytes());
        bytes.extend(text.as_bytes());
    }

    fn schema(id: u16, name: &str) -> Vec<u8> {
        let mut bytes = id.to_le_bytes().to_vec();
        text(&mut bytes, name);
        text(&mut bytes, "ros2msg");
        text(&mut bytes, "");
        bytes
    }

    fn channel(id: u16, schema: u16, topic: &str) -> Vec<u8> {
        let mut bytes = [id.to_le_bytes(), schema.to_le_bytes()].concat();
        text(&mut bytes, topic);
        text(&mut bytes, "cdr");
        text(&mut bytes, "");
        bytes
    }

    #[test]
    fn channels_of_one_topic_are_one_topic() {
        let mut channels = Channels::default();
        channels.define(op::SCHEMA, &schema(1, "sensor_msgs/Imu")).unwrap();
        for id in [4, 5] {
            channels.define(op::CHANNEL, &channel(id, 1, "/imu")).unwrap();
        }
        channels.define(op::CHANNEL, &channel(6, 0, "/raw")).unwrap();
        let topics = channels.topics(Some(&BTreeMap::from([(4, 10), (5, 20)])));
        assert_eq!(topics.len(), 2);
        assert_eq!((&*topics[0].name, &*topics[0].schema), ("/imu", "sensor_msgs/msg/Imu"));
        assert_eq!(topics[0].messages, Some(30));
        assert_eq!((&*topics[1].schema, topics[1].messages), ("", Some(0)));
        assert_eq!(channels.topics(None)[0].messages, None);
    }

    #[test]
    fn contradictions_are_faults() {
        let mut channels = Channels::default();
        assert!(channels.define(op::CHANNEL, &channel(1, 9, "/imu")).unwrap_err().contains("schema 9"));
        channels.define(op::CHANNEL, &channel(1, 0, "/imu")).unwrap();
        channels.define(op::CHANNEL, &channel(1, 0, "/imu")).unwrap();
        assert!(channels.define(op::CHANNEL, &channel(1, 0, "/mag")).unwrap_err().contains("twice"));
        channels.define(op::SCHEMA, &schema(1, "a/msg/B")).unwrap();
        channels.define(op::SCHEMA, &schema(1, "a/B")).unwrap();
        assert!(channels.define(op::SCHEMA, &schema(1, "a/msg/C")).unwrap_err().contains("both"));
    }

    #[test]
    fn a_definition_cut_anywhere_is_a_fault() {
        for (opcode, bytes) in [(op::SCHEMA, schema(1, "a/msg/B")), (op::CHANNEL, channel(1, 0, "/imu"))] {
            for end in 0..bytes.len() {
                assert!(Channels::default().define(opcode, &bytes[..end]).is_err(), "{opcode} {end}");
            }
        }
    }
}
