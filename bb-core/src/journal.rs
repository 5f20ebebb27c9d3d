//! The journal of a run: every entry that the robot processed, in order, with the data that came from outside. A
//! replay of it gives the same outputs, health, states, drops and counts.
//!
//! The robot's state has few writers: each island of estimators, and the control state (commands, operational state,
//! safety, parameters, supervision). Each changes only while it processes an entry, and each processed entry is a
//! line. Lines from outside hold the data: messages of sensors and services, parameters, effects and results of
//! commands, failed disarm callbacks, the duration of a measured callback.
//! [`Builder::replay`](crate::Builder::replay) can therefore run the robot again on virtual time, without its
//! sensors, services, actuators and commands.
//!
//! What subscribers do is no entry. If the code of a payload panics while an output is copied for them, its estimator is restarted,
//! which a replay does not repeat: it stops at the first output that differs.
//!
//! The journal begins with a description of the robot; a journal of another robot is refused, naming the first
//! difference. It holds a checksum of each output, so an algorithm that is not deterministic is named at the first
//! message that differs.
//!
//! Requests ([`Live::call`](crate::Live::call), [`Live::cast`](crate::Live::cast)) are recorded if their type defines how,
//! see [`HandleCall::RECORD`](crate::HandleCall::RECORD). For other requests, the journal holds only the outputs they
//! caused; if such a request changed the estimator otherwise, the replay stops at the first output that differs.

mod checksum;
mod entry;
mod queue;
mod reader;
mod writer;

pub(crate) use checksum::checksum;
pub use entry::{Callback, End, Entry, Event, JournalLine, ParameterEntry, Recorded, Request, RequestKind};
pub(crate) use queue::Waiting;
pub(crate) use reader::decoded;
pub use reader::{JournalReader, Publishers};
pub(crate) use writer::Journal;
pub use writer::Sink;
