//! Lines of a journal as a payload, so that they can be recorded like any other message.

use super::{Entry, Event};
use crate::Payload;
use crate::control::{ParameterValue, SafetyError};
use crate::message::DecodeError;
use crate::node::HealthTransition;
use crate::run::Robot;
use crate::time::MonotonicTime;
use std::fmt;

/// One line of a journal, as it is published at `journal`: see [`Builder::publish_journal`](crate::Builder::publish_journal).
#[derive(Clone, Debug, Payload)]
pub struct JournalLine {
    /// See [`Entry::number`].
    pub number: u64,
    /// See [`Entry::time`].
    pub time: MonotonicTime,
    event: Written,
}

/// [`Event`], with messages as bytes.
#[derive(Clone, Debug, Payload)]
enum Written {
    Message { publisher: u64, message: Vec<u8> },
    Deliver { island: u64, entry: u64, message: u64 },
    Drop { island: u64, entry: u64, message: u64 },
    Wake { island: u64 },
    Overrun { cause: u64, estimator: u64 },
    Unsafe { cause: u64, errors: Vec<SafetyError> },
    Failed { supervisor: u64, path: &'static str },
    Parameter { parameter: u64, value: ParameterValue },
    Command { command: u64 },
    Drive { health: Vec<HealthTransition>, given_up: Vec<&'static str> },
    Stop,
    Arm,
    Disarm { force: bool },
}

impl From<&Entry> for JournalLine {
    fn from(entry: &Entry) -> Self {
        let event = match &entry.event {
            Event::Message { publisher, message } => {
                let mut bytes = Vec::new();
                message.encode(&mut bytes);
                Written::Message { publisher: *publisher as u64, message: bytes }
            }
            Event::Deliver { island, entry, message } => {
                Written::Deliver { island: *island as u64, entry: *entry as u64, message: *message }
            }
            Event::Drop { island, entry, message } => {
                Written::Drop { island: *island as u64, entry: *entry as u64, message: *message }
            }
            Event::Wake { island } => Written::Wake { island: *island as u64 },
            Event::Overrun { cause, estimator } => Written::Overrun { cause: *cause, estimator: *estimator as u64 },
            Event::Unsafe { cause, errors } => Written::Unsafe { cause: *cause, errors: errors.clone() },
            Event::Failed { supervisor, path } => Written::Failed { supervisor: *supervisor as u64, path },
            Event::Parameter { parameter, value } => {
                Written::Parameter { parameter: *parameter as u64, value: value.clone() }
            }
            Event::Command { command } => Written::Command { command: *command as u64 },
            Event::Drive { health, given_up } => {
                Written::Drive { health: health.clone(), given_up: given_up.clone() }
            }
            Event::Stop => Written::Stop,
            Event::Arm => Written::Arm,
            Event::Disarm { force } => Written::Disarm { force: *force },
        };
        Self { number: entry.number, time: entry.time, event }
    }
}

/// Reads lines of a robot `R`.
pub struct JournalReader<R: Robot> {
    topics: R::Topics,
}

impl<R: Robot> Default for JournalReader<R> {
    fn default() -> Self {
        Self { topics: R::topics() }
    }
}

impl<R: Robot> JournalReader<R> {
    /// A line as [`Replay::play`](crate::Replay::play) takes it.
    ///
    /// # Errors
    /// Its message cannot be read: the payload had other fields then, or the line is of another robot.
    pub fn entry(&self, line: &JournalLine) -> Result<Entry, DecodeError> {
        // What does not fit names nothing, which the replay reports.
        let number = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        let event = match &line.event {
            Written::Message { publisher, message } => {
                let publisher = number(*publisher);
                let topics = R::all_topics(&self.topics);
                let topic = topics.get(publisher).ok_or_else(|| {
                    DecodeError::new(0, "a publisher of this robot", format!("number {publisher}"))
                })?;
                Event::Message { publisher, message: topic.decode(message)? }
            }
            Written::Deliver { island, entry, message } => {
                Event::Deliver { island: number(*island), entry: number(*entry), message: *message }
            }
            Written::Drop { island, entry, message } => {
                Event::Drop { island: number(*island), entry: number(*entry), message: *message }
            }
            Written::Wake { island } => Event::Wake { island: number(*island) },
            Written::Overrun { cause, estimator } => {
                Event::Overrun { cause: *cause, estimator: number(*estimator) }
            }
            Written::Unsafe { cause, errors } => Event::Unsafe { cause: *cause, errors: errors.clone() },
            Written::Failed { supervisor, path } => Event::Failed { supervisor: number(*supervisor), path },
            Written::Parameter { parameter, value } => {
                Event::Parameter { parameter: number(*parameter), value: value.clone() }
            }
            Written::Command { command } => Event::Command { command: number(*command) },
            Written::Drive { health, given_up } => {
                Event::Drive { health: health.clone(), given_up: given_up.clone() }
            }
            Written::Stop => Event::Stop,
            Written::Arm => Event::Arm,
            Written::Disarm { force } => Event::Disarm { force: *force },
        };
        Ok(Entry { number: line.number, time: line.time, event })
    }
}

impl<R: Robot> fmt::Debug for JournalReader<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("JournalReader").field(&R::NAME).finish()
    }
}
