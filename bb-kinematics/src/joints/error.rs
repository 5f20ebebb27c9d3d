//! Errors of transform lookups.

use bb_message::message::Payload;
use bb_message::time::MonotonicTime;
use std::fmt;
use std::time::Duration;

/// Reason for which there is no transform between two frames at a time.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LookupError {
    /// No state of a joint between the frames has arrived yet.
    UnknownJoint {
        /// The joint.
        joint: &'static str,
    },
    /// The history of a joint begins later than the requested time.
    TooOld {
        /// The joint.
        joint: &'static str,
        /// Time by which it begins later.
        by: Duration,
    },
    /// The newest state of a joint is older than the requested time.
    InFuture {
        /// The joint.
        joint: &'static str,
        /// Time by which it is older.
        by: Duration,
    },
    /// The robot has no frame of that name, and all frames that it has are connected. tf2 calls this a `LookupException`.
    UnknownFrame {
        /// The unknown frame or path.
        name: String,
        /// The nearest existing name.
        nearest: Option<String>,
    },
}

/// A [`LookupError`] with the joint given by its number in the topology, as written to a journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub enum Gap {
    /// No state has arrived yet.
    Unknown {
        /// The joint.
        joint: usize,
    },
    /// The joint's history begins later.
    TooOld {
        /// The joint.
        joint: usize,
        /// Time by which it begins later, in nanoseconds.
        nanos: i64,
    },
    /// The joint's newest state is older.
    InFuture {
        /// The joint.
        joint: usize,
        /// Time by which it is older, in nanoseconds.
        nanos: i64,
    },
}

impl Gap {
    /// The error with the names of the robot's joints.
    pub(super) fn error(self, name: impl Fn(usize) -> &'static str) -> LookupError {
        let duration = |nanos: i64| Duration::from_nanos(nanos.unsigned_abs());
        match self {
            Self::Unknown { joint } => LookupError::UnknownJoint { joint: name(joint) },
            Self::TooOld { joint, nanos } => LookupError::TooOld { joint: name(joint), by: duration(nanos) },
            Self::InFuture { joint, nanos } => LookupError::InFuture { joint: name(joint), by: duration(nanos) },
        }
    }
}

/// A [`Gap`] of one joint, which the caller knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Missing {
    Unknown,
    TooOld { nanos: i64 },
    InFuture { nanos: i64 },
}

impl Missing {
    pub(super) fn of(self, joint: usize) -> Gap {
        match self {
            Self::Unknown => Gap::Unknown { joint },
            Self::TooOld { nanos } => Gap::TooOld { joint, nanos },
            Self::InFuture { nanos } => Gap::InFuture { joint, nanos },
        }
    }

    /// The requested time is before the oldest state.
    pub(super) fn before(oldest: i64, time: MonotonicTime) -> Self {
        Self::TooOld { nanos: oldest.saturating_sub(time.as_nanos()) }
    }

    /// The requested time is after the newest state.
    pub(super) fn after(newest: i64, time: MonotonicTime) -> Self {
        Self::InFuture { nanos: time.as_nanos().saturating_sub(newest) }
    }
}

impl fmt::Display for LookupError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownJoint { joint } => write!(f, "nothing is known yet of the joint `{joint}`"),
            Self::TooOld { joint, by } => {
                write!(f, "the history of the joint `{joint}` begins {by:?} after the time asked for")
            }
            Self::InFuture { joint, by } => {
                write!(f, "the newest state of the joint `{joint}` is {by:?} older than the time asked for")
            }
            Self::UnknownFrame { name, nearest } => {
                write!(f, "the robot has no frame `{name}`")?;
                match nearest {
                    Some(near) => write!(f, "; did you mean `{near}`?"),
                    None => Ok(()),
                }
            }
        }
    }
}

impl std::error::Error for LookupError {}
