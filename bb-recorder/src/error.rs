//! What can go wrong, with the file it went wrong in.

use bb_core::message::DecodeError;
use mcap::McapError;
use std::io;
use std::path::{Path, PathBuf};

/// What went wrong with a file.
#[derive(Debug, thiserror::Error)]
#[error("{}: {kind}", path.display())]
pub struct RecordingError {
    path: PathBuf,
    #[source]
    kind: RecordingErrorKind,
}

impl RecordingError {
    pub(crate) fn new(path: &Path, kind: RecordingErrorKind) -> Self {
        Self { path: path.to_owned(), kind }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What went wrong.
    pub fn kind(&self) -> &RecordingErrorKind {
        &self.kind
    }

    /// Whether the file is read up to here and breaks off, as after a crash or a loss of power.
    pub fn is_break(&self) -> bool {
        matches!(self.kind, RecordingErrorKind::Broken { .. })
    }
}

/// See [`RecordingError`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingErrorKind {
    /// It is there already.
    #[error("it exists already, and recordings are not overwritten: remove it or choose another name")]
    Exists,
    /// It cannot be created.
    #[error("cannot be created: {0}")]
    Create(#[source] io::Error),
    /// It cannot be written on: the disk is full, say.
    #[error("cannot be written on after {messages} messages, the rest is not recorded: {cause}")]
    Write {
        /// How many messages had been written.
        messages: u64,
        /// Why.
        cause: io::Error,
    },
    /// Writing failed before.
    #[error("was given up at an earlier error")]
    GivenUp,
    /// The thread that writes could not be started, or has panicked.
    #[error("the thread that writes it {0}")]
    Thread(String),
    /// It cannot be read.
    #[error("cannot be read: {0}")]
    Read(#[source] io::Error),
    /// It is something else.
    #[error("it is no MCAP file")]
    NotMcap,
    /// Another program has written it.
    #[error(
        "it was written by `{library}`, not by this recorder; the reader for ROS 2 bags of other programs is `bb-bags`"
    )]
    Foreign {
        /// As the file says.
        library: String,
    },
    /// It breaks off or is damaged; what stands before was read.
    #[error(
        "it is broken at byte {byte}, after {messages} messages: {fault}; `recover` makes a whole file of what stands before"
    )]
    Broken {
        /// Where the last record starts.
        byte: u64,
        /// How many messages stand before.
        messages: u64,
        /// What is wrong.
        fault: String,
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
    Payload {
        /// The path.
        path: String,
        /// What was recorded.
        recorded: String,
        /// What was asked for.
        asked: &'static str,
        /// What that is.
        now: String,
    },
    /// A message is not what its channel says.
    #[error("a message of `{path}` is damaged: {cause}")]
    Message {
        /// The path.
        path: String,
        /// What is wrong with it.
        cause: DecodeError,
    },
}

/// Of an error while writing.
pub(crate) fn write_error(messages: u64, error: McapError) -> RecordingErrorKind {
    match error {
        McapError::Io(cause) => RecordingErrorKind::Write { messages, cause },
        McapError::AttemptedWriteAfterFailure => RecordingErrorKind::GivenUp,
        other => RecordingErrorKind::Write { messages, cause: io::Error::other(other.to_string()) },
    }
}
