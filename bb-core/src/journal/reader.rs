//! Reads the lines of a recorded journal.

use super::{Entry, Event, JournalLine, Recorded};
use crate::message::DecodeError;
use crate::pubsub::{AnyTopic, DynamicMessage, Encoded};
use std::fmt;

/// The publishers of a robot, whose payloads a journal refers to by number. Every [`Robot`](crate::Robot) has them.
pub trait Publishers {
    /// Topics of the publishers.
    #[doc(hidden)]
    type Topics;

    #[doc(hidden)]
    fn make_topics() -> Self::Topics;
    #[doc(hidden)]
    fn list_topics(topics: &Self::Topics) -> Vec<&dyn AnyTopic>;
}

/// Reads lines of a robot `R` from a recording. Their messages are decoded, so a payload whose fields have changed
/// since is detected before the journal is played.
pub struct JournalReader<R: Publishers> {
    topics: R::Topics,
}

impl<R: Publishers> Default for JournalReader<R> {
    fn default() -> Self {
        Self { topics: R::make_topics() }
    }
}

impl<R: Publishers> JournalReader<R> {
    /// A line in the form that [`Replay::play`](crate::Replay::play) takes.
    ///
    /// # Errors
    /// Its message cannot be read: the payload had other fields then, or the line is of another robot.
    pub fn entry(&self, line: &JournalLine) -> Result<Entry, DecodeError> {
        let mut line = line.clone();
        if let Event::Message { publisher, message } | Event::Emission { publisher, message, .. } = &mut line.event
        {
            let topics = R::list_topics(&self.topics);
            let topic = topics
                .get(*publisher)
                .ok_or_else(|| DecodeError::new(0, "a publisher of this robot", format!("number {publisher}")))?;
            *message = Recorded::Message(decoded(*topic, message.clone())?);
        }
        Ok(line)
    }
}

/// A message of a journal, decoded by its topic.
pub(crate) fn decoded(topic: &dyn AnyTopic, message: Recorded) -> Result<DynamicMessage, DecodeError> {
    match message {
        Recorded::Message(message) => Ok(message),
        Recorded::Bytes(bytes) => topic.decode(Encoded::Exact(&bytes), &|stamp| stamp),
    }
}

impl<R: Publishers> fmt::Debug for JournalReader<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("JournalReader").finish_non_exhaustive()
    }
}
