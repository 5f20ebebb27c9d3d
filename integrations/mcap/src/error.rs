//! Errors of a file, worded so that the reader can act on them.

use bb_core::message::DecodeError;
use mcap::McapError;
use std::io;
use std::path::{Path, PathBuf};

/// An error of a file.
///
/// `Display` gives the file, the fault and its place, then how to solve it, on one line.
#[derive(Debug, thiserror::Error)]
#[error("{}: {kind}", path.display())]
pub struct RecordingError {
    path: PathBuf,
    // Boxed, since it is part of the `Result` of every message.
    #[source]
    kind: Box<RecordingErrorKind>,
}

impl RecordingError {
    pub(crate) fn new(path: &Path, kind: RecordingErrorKind) -> Self {
        Self { path: path.to_owned(), kind: Box::new(kind) }
    }

    /// The file, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The kind of error, for code that distinguishes faults: a truncated file is often good enough.
    pub fn kind(&self) -> &RecordingErrorKind {
        &self.kind
    }

    /// Returns whether the file is read up to here and breaks off or is damaged, as after a crash or a loss of power.
    pub fn is_break(&self) -> bool {
        use RecordingErrorKind::{Compression, Corrupt, TooLarge, Truncated};
        matches!(*self.kind, Truncated { .. } | Corrupt { .. } | TooLarge { .. } | Compression { .. })
    }
}

/// The kinds of errors of a file; see [`RecordingError`].
///
/// Offsets are in bytes from the start of the file: of the record, or of the chunk that holds it. `messages`
/// counts the messages of all topics read before the place.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingErrorKind {
    /// File that does not exist.
    #[error("no such file; check the path")]
    Missing,
    /// The path is a directory or a device.
    #[error("not a file; name the .mcap or .db3 file itself, which a ROS 2 recording keeps in its directory")]
    NotAFile,
    /// The operating system refused.
    #[error("cannot be read at byte {byte}: {cause}; check the file's permissions and the disk")]
    Read {
        /// Byte at which reading stopped.
        byte: u64,
        /// Error of the operating system.
        cause: io::Error,
    },
    /// The file is something else than MCAP.
    #[error("not an MCAP file: {found}")]
    NotMcap {
        /// Kind of the file, as far as it can be guessed, and what to do with it.
        found: &'static str,
    },
    /// The file stops in the middle, as after a recorder that was killed; see [`recover`](crate::recover()).
    #[error(
        "truncated after {messages} messages (byte {byte} of {size}): the recorder was stopped or the copy is \
         incomplete; copy it again, or go on with the messages before the break, of which `bb recover` makes a whole \
         file"
    )]
    Truncated {
        /// Messages of all topics before the break.
        messages: u64,
        /// Byte at which the first incomplete record starts.
        byte: u64,
        /// The size of the file in bytes.
        size: u64,
    },
    /// A record contradicts the format or its checksum; see [`recover`](crate::recover()).
    #[error(
        "corrupt at byte {byte}, after {messages} messages: {fault}; copy the file again, or make a whole file of what \
         is before with `bb recover`"
    )]
    Corrupt {
        /// Messages of all topics before the place.
        messages: u64,
        /// Byte at which the record or chunk starts.
        byte: u64,
        /// Fault of the record or chunk.
        fault: String,
    },
    /// A record or chunk that this reader refuses to hold in memory.
    #[error(
        "a record of {length} bytes at byte {byte}, after {messages} messages, and at most {limit} are taken; \
         rewrite the file in smaller chunks, as with `mcap compress`"
    )]
    TooLarge {
        /// Messages of all topics before the place.
        messages: u64,
        /// Byte at which the record or chunk starts.
        byte: u64,
        /// Length in bytes, unpacked.
        length: u64,
        /// The longest accepted, in bytes.
        limit: u64,
    },
    /// A chunk is packed with an unknown method.
    #[error(
        "the chunk at byte {byte} is packed with `{compression}`, and only `lz4` and `zstd` are unpacked; record \
         or convert with one of these"
    )]
    Compression {
        /// Byte at which the chunk starts.
        byte: u64,
        /// The method the file names.
        compression: String,
    },
    /// A bag in SQLite is damaged, or a database of something else.
    #[error(
        "the database cannot be read after {messages} messages: {cause}; check that it is a bag of ROS 2, and copy it again"
    )]
    Database {
        /// Messages of all topics before the fault.
        messages: u64,
        /// Error of SQLite.
        cause: String,
    },
    /// The bag has no topic of that name.
    #[error("no topic {topic}; {topics}")]
    NoTopic {
        /// The name that was asked for.
        topic: String,
        /// The topics the bag has, in words.
        topics: String,
    },
    /// The bag has no topic of that type.
    #[error("no topic of type {schema}; {topics}")]
    NoTopicOfType {
        /// The type that was asked for.
        schema: String,
        /// The topics the bag has, in words.
        topics: String,
    },
    /// Several topics have that type, so none is chosen.
    #[error("several topics of type {schema}: {}; name one of them", candidates.join(", "))]
    SeveralTopicsOfType {
        /// The type that was asked for.
        schema: String,
        /// The names of the topics with that type.
        candidates: Vec<String>,
    },
    /// The topic that was named has another type.
    #[error("the messages of {topic} are {schema}, and {wanted} is needed here; name a topic of that type")]
    OtherType {
        /// The topic.
        topic: String,
        /// Type of its messages.
        schema: String,
        /// The type that is needed.
        wanted: String,
    },
    /// The messages of the topic are not CDR.
    #[error(
        "the messages of {topic} are encoded as `{encoding}`, and only `cdr` is read; record with ROS 2 or \
         convert the bag to it"
    )]
    Encoding {
        /// The topic.
        topic: String,
        /// The encoding its channel names.
        encoding: String,
    },
    /// The payload of one message is malformed.
    #[error(
        "message {message} on {topic} at {} s (byte {byte}): {fault}; it is damaged, or the recorder's {schema} \
         has other fields",
        seconds(*log_time_ns)
    )]
    Payload {
        /// The topic.
        topic: String,
        /// The type the payload should have.
        schema: String,
        /// The number of the message on its topic, from 1.
        message: u64,
        /// Time at which it was logged, in nanoseconds of the recorder's clock.
        log_time_ns: u64,
        /// Byte at which its record starts, or the chunk that holds it.
        byte: u64,
        /// Fault of the payload.
        fault: String,
    },
    /// The file to write exists already.
    #[error("it exists already, and recordings are not overwritten: remove it or choose another name")]
    Exists,
    /// The file cannot be created.
    #[error("cannot be created: {0}")]
    Create(#[source] io::Error),
    /// The file cannot be written to, for example because the disk is full.
    #[error("cannot be written to, {} certain to be in it: {cause}", first(*.messages))]
    Write {
        /// Number of messages that are in the file for certain, from the first on: those that had been flushed.
        messages: u64,
        /// Error of the operating system.
        cause: io::Error,
    },
    /// Another program has removed or truncated the file while it was written.
    #[error(
        "was {change} by another program, and none of the {messages} messages is certain to be in it; record to a file \
         that no other program cleans up"
    )]
    Taken {
        /// Messages that had been written.
        messages: u64,
        /// `removed` or `truncated`.
        change: &'static str,
    },
    /// An earlier write failed.
    #[error("was given up at an earlier error")]
    GivenUp,
    /// The thread that writes could not be started, or has panicked.
    #[error("the thread that writes it {0}")]
    Thread(String),
    /// Two payloads would be recorded under one name with different fields, which no reader could tell apart.
    #[error(
        "`{first}` and `{second}` publish different types that would both be recorded as `{name}`; give one of the \
         types another name, as with `#[payload(name = \"my_robot/Name\")]`"
    )]
    SameName {
        /// The name of the definition.
        name: String,
        /// The path that has it.
        first: String,
        /// The path that would have it too.
        second: String,
    },
    /// Another program has written the file.
    #[error(
        "it was written by `{library}`, so that it holds ROS's messages and not what a robot published; read it with \
         `bb_mcap::Bag`"
    )]
    Foreign {
        /// Name of the program, according to the file.
        library: String,
    },
    /// Nothing was recorded at this path.
    #[error("nothing was recorded at `{path}`; there are {paths}")]
    NoPath {
        /// The path.
        path: String,
        /// The paths there are.
        paths: String,
    },
    /// Another payload was recorded, or the same when it had other fields.
    #[error("`{path}` was recorded as {recorded}, and `{asked}` is now {now}")]
    OtherPayload {
        /// The path.
        path: String,
        /// Fields of the payload that was recorded.
        recorded: String,
        /// Name of the payload that was asked for.
        asked: &'static str,
        /// Current fields of that payload.
        now: String,
    },
    /// A message does not match its channel.
    #[error("a message of `{path}` is damaged: {cause}")]
    Message {
        /// The path.
        path: String,
        /// Fault of the message.
        cause: DecodeError,
    },
}

/// Converts an error while creating a file.
pub(crate) fn create_error(cause: io::Error) -> RecordingErrorKind {
    match cause.kind() {
        io::ErrorKind::AlreadyExists => RecordingErrorKind::Exists,
        _ => RecordingErrorKind::Create(cause),
    }
}

/// Describes the messages that are certain to be in a file.
fn first(messages: u64) -> String {
    match messages {
        0 => "no message is".to_owned(),
        1 => "only the first message is".to_owned(),
        messages => format!("only the first {messages} messages are"),
    }
}

/// Converts an error while writing, after so many messages had been flushed.
pub(crate) fn write_error(messages: u64, error: McapError) -> RecordingErrorKind {
    match error {
        McapError::Io(cause) => RecordingErrorKind::Write { messages, cause },
        McapError::AttemptedWriteAfterFailure => RecordingErrorKind::GivenUp,
        other => RecordingErrorKind::Write { messages, cause: io::Error::other(other.to_string()) },
    }
}

/// Nanoseconds as seconds with three digits, enough to find a message.
fn seconds(ns: u64) -> String {
    format!("{}.{:03}", ns / 1_000_000_000, ns / 1_000_000 % 1000)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_file_fault_and_way_out() {
        let kind = RecordingErrorKind::NoTopicOfType {
            schema: "sensor_msgs/msg/Imu".into(),
            topics: "the bag has /scan (sensor_msgs/msg/LaserScan)".into(),
        };
        assert_eq!(
            RecordingError::new(Path::new("walk.mcap"), kind).to_string(),
            "walk.mcap: no topic of type sensor_msgs/msg/Imu; the bag has /scan (sensor_msgs/msg/LaserScan)"
        );
    }

    #[test]
    fn a_payload_error_names_message_topic_and_time() {
        let kind = RecordingErrorKind::Payload {
            topic: "/imu".into(),
            schema: "sensor_msgs/msg/Imu".into(),
            message: 1024,
            log_time_ns: 12_345_678_901,
            byte: 51_200,
            fault: "the payload ends too early".into(),
        };
        let said = RecordingError::new(Path::new("walk.mcap"), kind).to_string();
        assert!(said.starts_with("walk.mcap: message 1024 on /imu at 12.345 s (byte 51200): the payload ends"));
    }

    #[test]
    fn errors_cross_threads() {
        fn check<T: Send + Sync + 'static>() {}
        check::<RecordingError>();
    }
}
