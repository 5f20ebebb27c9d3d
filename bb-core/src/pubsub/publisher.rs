//! Publishing at a path that the robot does not declare.

use super::{AnyTopic as _, DynamicMessage, Topic};
use crate::message::{Payload, Stamp, Stamped};
use crate::time::WallTime;
use std::fmt;
use std::sync::Arc;

/// Publishes payloads of type `T` at a path that the robot does not declare: see [`Bus::publisher`](crate::Bus::publisher).
/// Clones publish at the same path. The path remains when the last of them is dropped.
pub struct Publisher<T> {
    topic: Arc<Topic<T>>,
    gate: Arc<dyn Gate>,
}

/// The checks that a publisher passes on its way to its topic.
pub(crate) trait Gate: Send + Sync {
    /// Has `publish` called with the stamp of a payload that is published now; not once the publisher may not act any more.
    fn pass(&self, publish: &mut dyn FnMut(Stamp));
    /// Whether messages are to be shown to [`Self::note`].
    fn is_noted(&self) -> bool;
    /// A message is about to be published.
    fn note(&self, message: DynamicMessage);
}

impl<T: Payload> Publisher<T> {
    pub(crate) fn new(topic: Arc<Topic<T>>, gate: Arc<dyn Gate>) -> Self {
        Self { topic, gate }
    }

    /// Publishes a payload measured now, in no frame. Once the command that made this publisher has ended, or the robot has
    /// stopped, nothing is published any more.
    pub fn publish(&self, payload: T) {
        let mut payload = Some(payload);
        self.gate.pass(&mut |stamp| {
            if let Some(payload) = payload.take() {
                self.hand_out(&stamp.message(payload));
            }
        });
    }

    /// Publishes a message with its own stamp, for messages forwarded from elsewhere. One without a wall time, such as
    /// [`Stamped::new`] makes, gets that of the robot's clock at its monotonic time.
    pub fn forward(&self, message: &Stamped<T>) {
        self.gate.pass(&mut |now| {
            if message.wall_time != WallTime::default() {
                return self.hand_out(message);
            }
            let age = now.monotonic_time.nanos_since(message.monotonic_time);
            let nanos = now.wall_time.as_unix_nanos().saturating_sub(age);
            self.hand_out(&Stamped { wall_time: WallTime::from_unix_nanos(nanos), ..message.clone() });
        });
    }

    fn hand_out(&self, message: &Stamped<T>) {
        if self.gate.is_noted() {
            let noted = DynamicMessage::new(self.path(), message);
            self.topic.publish_as_written(message, || self.gate.note(noted));
        } else {
            self.topic.publish(message);
        }
    }

    /// Its path.
    pub fn path(&self) -> &'static str {
        self.topic.path()
    }
}

impl<T> Clone for Publisher<T> {
    fn clone(&self) -> Self {
        Self { topic: Arc::clone(&self.topic), gate: Arc::clone(&self.gate) }
    }
}

impl<T: Payload> fmt::Debug for Publisher<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Publisher").field("path", &self.path()).finish_non_exhaustive()
    }
}
