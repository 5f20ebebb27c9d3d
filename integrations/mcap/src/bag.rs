//! A bag: a file and the topics in it.

mod imu;
mod message;
mod messages;
mod samples;
mod sensor;
#[cfg(feature = "sqlite")]
mod sqlite;
mod summary;
mod truth;

pub use imu::{BagImu, BagImuOptions};
pub use message::BagMessage;
pub use messages::BagMessages;
pub use samples::{IMU, MAGNETIC_FIELD, MargSamples};
pub use sensor::{BagSensor, BagSensorOptions};
pub use truth::{Bool, MOVING, ODOMETRY, POSE, Truth};

use crate::definition::MessageDefinition;
use crate::error::{RecordingError, RecordingErrorKind};
use crate::file::{Channels, Record, Records, full_name};
use crate::layout::PATH;
use message::Wanted;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A topic of a bag.
///
/// A name occurs twice only if its messages changed type or encoding on the way.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Topic {
    /// The name, as `/imu`.
    pub name: Arc<str>,
    /// The type in its full spelling, such as `sensor_msgs/msg/Imu` even if the file says `sensor_msgs/Imu`; empty if
    /// the file gives none.
    pub schema: Arc<str>,
    /// The encoding of the messages, usually `cdr`.
    pub encoding: Arc<str>,
    /// The definition of the type in the file; empty if there is none.
    pub definition: Arc<str>,
    /// The format of the definition, for example `ros2msg`.
    pub definition_encoding: Arc<str>,
    /// `true` if it is from a recording of a robot of this project. Its poses may be estimates, so they are not used as
    /// truth by default.
    pub is_own: bool,
    /// The number of messages, in a damaged bag before the damage; `None` if a summary leaves it out.
    pub messages: Option<u64>,
}

impl Topic {
    /// Returns whether it has this name, with or without a leading slash.
    pub fn is_named(&self, name: &str) -> bool {
        *self.name == *name || self.name.strip_prefix('/') == Some(name.trim_start_matches('/'))
    }

    /// The fields of the messages.
    ///
    /// # Errors
    ///
    /// The file has no readable definition of the type, and the type is not a known one; in words.
    pub fn message_definition(&self) -> Result<MessageDefinition, String> {
        MessageDefinition::of(&self.schema, &self.definition_encoding, &self.definition)
    }
}

/// A recording of ROS 2 messages in an MCAP file, or with the feature `sqlite` in a `.db3` file.
#[derive(Debug, Clone)]
pub struct Bag {
    path: PathBuf,
    topics: Vec<Topic>,
}

impl Bag {
    /// Opens a bag and finds its topics: from its summary, or by reading it once if there is none.
    ///
    /// A bag that is cut off opens if it has topics before the cut; [`messages`](Self::messages) reports the cut when
    /// it reaches it.
    ///
    /// # Errors
    ///
    /// If the file is missing, unreadable or no MCAP, or breaks before the first topic.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let topics = topics(path).map_err(|kind| RecordingError::new(path, kind))?;
        Ok(Self { path: path.to_owned(), topics })
    }

    /// The path of the file, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The topics, in the order in which the recorder numbered them.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// The only topic of a type; `sensor_msgs/Imu` and `sensor_msgs/msg/Imu` are one type.
    ///
    /// # Errors
    ///
    /// There is none, and the error lists all topics; or several, and it lists those.
    pub fn topic_of(&self, schema: &str) -> Result<&Topic, RecordingError> {
        let schema = full_name(schema);
        let mut found = self.topics.iter().filter(|t| *t.schema == *schema);
        let kind = match (found.next(), found.next()) {
            (Some(topic), None) => return Ok(topic),
            (None, _) => RecordingErrorKind::NoTopicOfType { schema, topics: self.topics_in_words() },
            (Some(a), Some(b)) => {
                let candidates = [a, b].into_iter().chain(found).map(|t| t.name.to_string()).collect();
                RecordingErrorKind::SeveralTopicsOfType { schema, candidates }
            }
        };
        Err(RecordingError::new(&self.path, kind))
    }

    /// The topic of this name, if one is given, with or without its leading slash; it must be of the type. Otherwise the only one
    /// of the type.
    ///
    /// # Errors
    ///
    /// There is none of this name, it has another type, or the type is ambiguous.
    pub fn choose(&self, schema: &str, name: Option<&str>) -> Result<&Topic, RecordingError> {
        let Some(name) = name else { return self.topic_of(schema) };
        let wanted = full_name(schema);
        let mut named = self.topics.iter().filter(|topic| topic.is_named(name)).peekable();
        let kind = match named.peek() {
            None => RecordingErrorKind::NoTopic { topic: name.to_owned(), topics: self.topics_in_words() },
            Some(first) => {
                let schema = first.schema.to_string();
                match named.find(|topic| *topic.schema == *wanted) {
                    Some(topic) => return Ok(topic),
                    None => RecordingErrorKind::OtherType { topic: name.to_owned(), schema, wanted },
                }
            }
        };
        Err(RecordingError::new(&self.path, kind))
    }

    /// The topic of the magnetometer that belongs to an IMU: the one of this name, if given; otherwise the one
    /// written beside the IMU by a recorder of this crate; otherwise the only one of its type.
    ///
    /// # Errors
    ///
    /// As [`choose`](Self::choose).
    pub fn magnetometer_of(&self, imu: &str, name: Option<&str>) -> Result<&Topic, RecordingError> {
        let beside = format!("{imu}/magnetic_field");
        match (name, self.choose(MAGNETIC_FIELD, Some(&beside))) {
            (None, Ok(topic)) => Ok(topic),
            _ => self.choose(MAGNETIC_FIELD, name),
        }
    }

    /// The messages of the named topics, read lazily, in the order of the file.
    ///
    /// Recorders write messages as they arrive, so the order of the file is, with small exceptions, that of the log times;
    /// it need not be that of the stamps. Without names there are no messages. The iterator opens the file
    /// itself: it can be sent to another thread and outlive the bag, and several can read at the same time.
    ///
    /// # Errors
    ///
    /// If the bag has no topic of a name, or its messages are not CDR, or the file can no longer be opened.
    pub fn messages<S: AsRef<str>>(&self, topics: &[S]) -> Result<BagMessages, RecordingError> {
        self.messages_of(topics, true)
    }

    /// Reads topics in any encoding; for messages that are not CDR only the bytes are available.
    ///
    /// # Errors
    ///
    /// If the bag has no topic of a name, or the file can no longer be opened.
    pub fn messages_in_any_encoding<S: AsRef<str>>(&self, topics: &[S]) -> Result<BagMessages, RecordingError> {
        self.messages_of(topics, false)
    }

    fn messages_of<S: AsRef<str>>(&self, topics: &[S], only_cdr: bool) -> Result<BagMessages, RecordingError> {
        let fail = |kind| RecordingError::new(&self.path, kind);
        let mut wanted: Vec<Wanted> = Vec::new();
        for name in topics.iter().map(AsRef::as_ref) {
            if wanted.iter().any(|w| *w.topic == *name) {
                continue;
            }
            let mut same = self.topics.iter().filter(|t| *t.name == *name).peekable();
            let Some(first) = same.peek() else {
                let kind = RecordingErrorKind::NoTopic { topic: name.to_owned(), topics: self.topics_in_words() };
                return Err(fail(kind));
            };
            let mut new = Wanted { topic: first.name.clone(), expected: 0, count: 0 };
            for topic in same {
                if only_cdr {
                    message::check(&topic.name, &topic.encoding).map_err(fail)?;
                }
                new.expected = new.expected.saturating_add(topic.messages.unwrap_or(0));
            }
            wanted.push(new);
        }
        BagMessages::open(&self.path, wanted, only_cdr)
    }

    /// The topics for an error message.
    fn topics_in_words(&self) -> String {
        if self.topics.is_empty() {
            return "the bag has no topics".into();
        }
        let topics: Vec<_> = self.topics.iter().map(|t| format!("{} ({})", t.name, t.schema)).collect();
        format!("the bag has {}", topics.join(", "))
    }
}

fn topics(path: &Path) -> Result<Vec<Topic>, RecordingErrorKind> {
    #[cfg(feature = "sqlite")]
    if sqlite::is_database(path) {
        return sqlite::topics(path);
    }
    let records = Records::open(path)?;
    let size = records.size();
    if let Some(topics) = summary::topics(records.into_file(), size) {
        return Ok(topics);
    }
    let mut records = Records::open(path)?;
    let mut channels = Channels::default();
    let mut counts = BTreeMap::new();
    let end = scan(&mut records, &mut channels, &mut counts);
    let topics = topics_of(&channels, Some(&counts));
    match end {
        Err(kind) if topics.is_empty() => Err(kind),
        _ => Ok(topics),
    }
}

fn scan(
    records: &mut Records,
    channels: &mut Channels,
    counts: &mut BTreeMap<u16, u64>,
) -> Result<(), RecordingErrorKind> {
    while records.advance()? {
        match records.record()? {
            Record::Message { channel, .. } => *counts.entry(channel).or_default() += 1,
            other => _ = channels.define(other).map_err(|fault| records.corrupt(fault))?,
        }
    }
    Ok(())
}

/// The topics of these channels, with the number of messages of each if `counts` (by channel) are known.
fn topics_of(channels: &Channels, counts: Option<&BTreeMap<u16, u64>>) -> Vec<Topic> {
    let mut topics: Vec<Topic> = Vec::new();
    for (id, channel) in channels.iter() {
        let count = counts.map(|counts| counts.get(&id).copied().unwrap_or(0));
        let is_same = |topic: &&mut Topic| {
            topic.name == channel.topic && topic.schema == channel.schema && topic.encoding == channel.encoding
        };
        if let Some(topic) = topics.iter_mut().find(is_same) {
            topic.messages = topic.messages.zip(count).map(|(a, b)| a.saturating_add(b));
        } else {
            topics.push(Topic {
                name: Arc::clone(&channel.topic),
                schema: Arc::clone(&channel.schema),
                encoding: Arc::clone(&channel.encoding),
                definition: String::from_utf8_lossy(&channel.definition).into(),
                definition_encoding: Arc::clone(&channel.definition_encoding),
                is_own: channel.metadata.contains_key(PATH),
                messages: count,
            });
        }
    }
    topics
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_of_one_topic_are_one_topic() {
        let mut channels = Channels::default();
        let schema = Record::Schema { id: 1, name: "sensor_msgs/Imu", encoding: "ros2msg", data: &[] };
        channels.define(schema).expect("defined");
        for (id, schema, topic) in [(4, 1, "/imu"), (5, 1, "/imu"), (6, 0, "/raw")] {
            let channel = Record::Channel { id, schema, topic, encoding: "cdr", metadata: BTreeMap::new() };
            channels.define(channel).expect("defined");
        }
        let topics = topics_of(&channels, Some(&BTreeMap::from([(4, 10), (5, 20)])));
        assert_eq!(topics.len(), 2);
        assert_eq!((&*topics[0].name, &*topics[0].schema), ("/imu", "sensor_msgs/msg/Imu"));
        assert_eq!(topics[0].messages, Some(30));
        assert_eq!((&*topics[1].schema, topics[1].messages), ("", Some(0)));
        assert_eq!(topics_of(&channels, None)[0].messages, None);
    }
}
