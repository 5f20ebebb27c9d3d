//! Topics of a bag by the names on the command line, and their messages of any type.

use crate::values::FromJson;
use bb_core::message::codec::ros::Header;
use bb_eval::Progress;
use bb_eval::filters::near;
use bb_mcap::{Bag, BagMessage, MessageDefinition, Topic, Value};
use std::path::Path;

/// Encoding of messages in JSON.
const JSON: &str = "json";

const SECOND_NS: u64 = 1_000_000_000;

/// Opens a bag, by its file, its folder or the description in that; the error names the file.
pub(crate) fn open(file: &Path) -> Result<Bag, String> {
    Bag::open(bb_eval::files::recording(file)?).map_err(|error| error.to_string())
}

/// The topic of this name, with or without a leading slash.
pub(crate) fn find<'a>(bag: &'a Bag, name: &str) -> Result<&'a Topic, String> {
    let found = bag.topics().iter().find(|topic| topic.is_named(name));
    found.ok_or_else(|| {
        let full = format!("/{}", name.trim_start_matches('/'));
        let names: Vec<&str> = bag.topics().iter().map(|topic| &*topic.name).collect();
        let file = bag.path().display();
        match names.is_empty() {
            true => format!("{file}: no topic {full}; the bag has no topics"),
            false => format!("{file}: no topic {full}; {}", near(&full, &names)),
        }
    })
}

/// Reads the messages of topics with a progress bar, and returns the damage that cuts the file off, if any.
pub(crate) fn read_all(
    bag: &Bag,
    topics: &[&Topic],
    mut take: impl FnMut(&BagMessage) -> Result<(), String>,
) -> Result<Option<String>, String> {
    let names: Vec<_> = topics.iter().map(|topic| &topic.name).collect();
    let progress = Progress::new("reading", topics.iter().filter_map(|topic| topic.messages).sum());
    let mut broken = None;
    for message in bag.messages_in_any_encoding(&names).map_err(|error| error.to_string())? {
        match message {
            Ok(message) => take(&message)?,
            Err(error) => {
                broken = Some(error.to_string());
                break;
            }
        }
        progress.add(1);
    }
    progress.finish();
    Ok(broken)
}

/// Returns whether a topic reports events of a robot: no rate is expected of it.
pub(crate) fn is_of_events(topic: &Topic) -> bool {
    const EVENTS: [&str; 7] = ["health", "fault", "state_machine", "safety", "command", "param", "journal"];
    let first = topic.name.trim_start_matches('/').split('/').next();
    topic.is_own && first.is_some_and(|first| EVENTS.contains(&first))
}

/// Reads the messages of a topic.
#[derive(Debug)]
pub(crate) enum TopicReader {
    Cdr(MessageDefinition),
    Json,
}

impl TopicReader {
    /// Creates the reader of a topic; the error says why its messages cannot be read.
    pub(crate) fn new(topic: &Topic) -> Result<Self, String> {
        match &*topic.encoding {
            "cdr" => topic.message_definition().map(Self::Cdr).map_err(|fault| format!("{}: {fault}", topic.name)),
            JSON => Ok(Self::Json),
            other => Err(format!(
                "the messages of {} are encoded as `{other}`, and only `cdr` and `{JSON}` are read; convert the bag",
                topic.name
            )),
        }
    }

    /// The fields of a message.
    pub(crate) fn read(&self, message: &BagMessage) -> Result<Value, String> {
        match self {
            Self::Cdr(definition) => message.value(definition).map_err(|error| error.to_string()),
            Self::Json => serde_json::from_slice(&message.data)
                .map(|FromJson(value)| value)
                .map_err(|error| format!("a message of {} is not JSON: {error}", message.topic)),
        }
    }

    /// The time in the header of a message, nanoseconds; `None` if it has no header, or the header has no time.
    pub(crate) fn stamp_ns(&self, message: &BagMessage) -> Option<i64> {
        let stamp_ns = self.header(message)?.stamp.wall_time().as_unix_nanos();
        // Zero means not set, except for a clock that begins with the recording.
        (stamp_ns != 0 || message.log_time_ns < SECOND_NS).then_some(stamp_ns)
    }

    /// The header of a message, if its type has one.
    pub(crate) fn header(&self, message: &BagMessage) -> Option<Header> {
        match self {
            Self::Cdr(definition) if definition.has_header() => message.header().ok(),
            _ => None,
        }
    }
}

/// Returns the time at which a message was logged, nanoseconds.
pub(crate) fn log_ns(message: &BagMessage) -> i64 {
    i64::try_from(message.log_time_ns).unwrap_or(i64::MAX)
}
