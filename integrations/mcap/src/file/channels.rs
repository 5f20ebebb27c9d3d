//! The schemas and channels that a file defines while it is read.

use super::Record;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// A stream of messages of one topic; a topic may have several, one for each publisher.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) topic: Arc<str>,
    /// The full name of the type; empty if the file gives none.
    pub(crate) schema: Arc<str>,
    pub(crate) definition: Arc<[u8]>,
    /// The format of the definition, for example `ros2msg`.
    pub(crate) definition_encoding: Arc<str>,
    pub(crate) encoding: Arc<str>,
    pub(crate) metadata: BTreeMap<String, String>,
}

/// The type of the messages of channels.
#[derive(Clone, Debug, Default)]
struct Schema {
    name: Arc<str>,
    definition: Arc<[u8]>,
    encoding: Arc<str>,
}

/// All channels met so far.
#[derive(Debug, Default)]
pub(crate) struct Channels {
    schemas: HashMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
}

impl Channels {
    /// Adds a schema or a channel, and returns the channel if it is new; ignores other records. The error says what
    /// is wrong.
    pub(crate) fn define(&mut self, record: Record<'_>) -> Result<Option<(u16, &Channel)>, String> {
        match record {
            Record::Schema { id, name, encoding, data } => {
                let name: Arc<str> = full_name(name).into();
                let new = Schema { name: Arc::clone(&name), definition: data.into(), encoding: encoding.into() };
                match self.schemas.insert(id, new) {
                    Some(old) if old.name != name => Err(format!("schema {id} is both {} and {name}", old.name)),
                    _ => Ok(None),
                }
            }
            Record::Channel { id, schema, topic, encoding, metadata } => {
                let schema = match self.schemas.get(&schema) {
                    Some(schema) => schema.clone(),
                    None if schema == 0 => Schema::default(),
                    None => return Err(format!("{topic} has the unknown schema {schema}")),
                };
                let new = Channel {
                    topic: topic.into(),
                    schema: schema.name,
                    definition: schema.definition,
                    definition_encoding: schema.encoding,
                    encoding: encoding.into(),
                    metadata,
                };
                match self.channels.get(&id) {
                    Some(old) if *old != new => {
                        Err(format!("channel {id} is defined twice, for {} and {topic}", old.topic))
                    }
                    Some(_) => Ok(None),
                    None => Ok(Some((id, self.channels.entry(id).or_insert(new)))),
                }
            }
            _ => Ok(None),
        }
    }

    pub(crate) fn get(&self, id: u16) -> Option<&Channel> {
        self.channels.get(&id)
    }

    /// Returns the channels by number.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u16, &Channel)> {
        self.channels.iter().map(|(id, channel)| (*id, channel))
    }
}

/// The full spelling of a type's name: some writers say `sensor_msgs/Imu` for `sensor_msgs/msg/Imu`.
pub(crate) fn full_name(schema: &str) -> String {
    match schema.split_once('/') {
        Some((package, name)) if !name.contains('/') => format!("{package}/msg/{name}"),
        _ => schema.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schema(id: u16, name: &str) -> Record<'_> {
        Record::Schema { id, name, encoding: "ros2msg", data: &[] }
    }

    fn channel(id: u16, schema: u16, topic: &str) -> Record<'_> {
        Record::Channel { id, schema, topic, encoding: "cdr", metadata: BTreeMap::new() }
    }

    #[test]
    fn both_spellings_of_a_type_are_one() {
        assert_eq!(full_name("sensor_msgs/Imu"), "sensor_msgs/msg/Imu");
        assert_eq!(full_name("sensor_msgs/msg/Imu"), "sensor_msgs/msg/Imu");
        assert_eq!(full_name("Imu"), "Imu");
        assert_eq!(full_name(""), "");
    }

    #[test]
    fn contradictions_are_faults() {
        let mut channels = Channels::default();
        assert!(channels.define(channel(1, 9, "/imu")).unwrap_err().contains("schema 9"));
        assert!(channels.define(channel(1, 0, "/imu")).expect("defined").is_some());
        assert!(channels.define(channel(1, 0, "/imu")).expect("the same again").is_none());
        assert!(channels.define(channel(1, 0, "/mag")).unwrap_err().contains("twice"));
        channels.define(schema(1, "a/msg/B")).expect("defined");
        channels.define(schema(1, "a/B")).expect("the same again");
        assert!(channels.define(schema(1, "a/msg/C")).unwrap_err().contains("both"));
    }
}
