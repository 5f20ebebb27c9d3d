//! Publishing at a path that the robot does not declare.

use super::{AnyTopic as _, DynamicMessage, Topic};
use crate::message::{Frame, JointReading, Payload, Stamp, Stamped};
use crate::time::MonotonicTime;
use std::fmt;
use std::sync::{Arc, Weak};

/// Publishes payloads of type `T` at a path that the robot does not declare: see [`Bus::publisher`](crate::Bus::publisher).
/// Clones publish at the same path. The path remains when the last of them is dropped.
pub struct Publisher<T> {
    target: Target<T>,
    gate: Arc<dyn Gate>,
}

/// Target of the messages.
enum Target<T> {
    /// The subscribers of a path of the caller's choice.
    Topic(Arc<Topic<T>>),
    /// A sensor of the robot whose messages other code publishes, at `path`, in `frame` unless they have one.
    Sensor { path: &'static str, frame: Frame, enter: Weak<Enter<T>> },
}

/// Publishes a message and runs everything downstream.
pub(crate) type Enter<T> = dyn Fn(&Stamped<T>, MonotonicTime) + Send + Sync;

/// Calls a listener with what a message tells of joints.
pub(crate) type Tell<'a> = dyn Fn(&mut dyn FnMut(JointReading<'_>)) + 'a;

/// The checks that a publisher passes on its way to its topic.
pub(crate) trait Gate: Send + Sync {
    /// Calls `publish` with the stamp of a payload that is published now; not once the publisher may not act any more.
    fn pass(&self, publish: &mut dyn FnMut(Stamp));
    /// Returns whether messages are to be shown to [`Self::note`].
    fn is_noted(&self) -> bool;
    /// The publisher's caller is about to publish a message.
    fn note_caller(&self);
    /// A message is about to be published, at this time.
    fn note(&self, message: DynamicMessage, now: MonotonicTime);
    /// A message that tells of joints is about to be published at `path`.
    fn hear(&self, path: &str, stamp: Stamp, now: MonotonicTime, tell: &Tell<'_>);
}

impl<T: Payload> Publisher<T> {
    pub(crate) fn new(topic: Arc<Topic<T>>, gate: Arc<dyn Gate>) -> Self {
        Self { target: Target::Topic(topic), gate }
    }

    pub(crate) fn of_sensor(path: &'static str, frame: Frame, enter: Weak<Enter<T>>, gate: Arc<dyn Gate>) -> Self {
        Self { target: Target::Sensor { path, frame, enter }, gate }
    }

    /// Publishes a payload measured now, in no frame. Once the command that made this publisher has ended, or the robot has
    /// stopped, nothing is published any more.
    pub fn publish(&self, payload: T) {
        let mut payload = Some(payload);
        self.gate.pass(&mut |stamp| {
            if let Some(payload) = payload.take() {
                self.hand_out(&Stamp { frame: self.frame(), ..stamp }.message(payload), stamp.monotonic_time);
            }
        });
    }

    /// Publishes a message with its own stamp, for messages forwarded from elsewhere. One without a wall time, such as
    /// [`Stamped::new`] makes, gets that of the robot's clock at its monotonic time.
    pub fn forward(&self, message: &Stamped<T>) {
        self.gate.pass(&mut |now| {
            let stamp = message.stamp().completed(now, self.frame());
            match stamp == message.stamp() {
                true => self.hand_out(message, now.monotonic_time),
                false => self.hand_out(&stamp.message(message.payload.clone()), now.monotonic_time),
            }
        });
    }

    fn hand_out(&self, message: &Stamped<T>, now: MonotonicTime) {
        self.gate.note_caller();
        if let Target::Topic(topic) = &self.target
            && T::TELLS_JOINT_POSITION
        {
            self.gate.hear(topic.path(), message.stamp(), now, &|listener| {
                message.payload.tell_joints(&mut |reading| listener(reading));
            });
        }
        match &self.target {
            Target::Topic(topic) if self.gate.is_noted() => {
                let noted = DynamicMessage::new(topic.path(), message);
                topic.publish_as_written(message, || self.gate.note(noted, now));
            }
            Target::Topic(topic) => topic.publish(message),
            Target::Sensor { enter, .. } => {
                if let Some(enter) = enter.upgrade() {
                    enter(message, now);
                }
            }
        }
    }

    /// Frame of a message without one.
    fn frame(&self) -> Frame {
        match &self.target {
            Target::Topic(_) => Frame::NONE,
            Target::Sensor { frame, .. } => *frame,
        }
    }

    /// Returns the path.
    pub fn path(&self) -> &'static str {
        match &self.target {
            Target::Topic(topic) => topic.path(),
            Target::Sensor { path, .. } => path,
        }
    }
}

impl<T> Clone for Publisher<T> {
    fn clone(&self) -> Self {
        Self { target: self.target.clone(), gate: Arc::clone(&self.gate) }
    }
}

impl<T> Clone for Target<T> {
    fn clone(&self) -> Self {
        match self {
            Self::Topic(topic) => Self::Topic(Arc::clone(topic)),
            Self::Sensor { path, frame, enter } => Self::Sensor { path, frame: *frame, enter: Weak::clone(enter) },
        }
    }
}

impl<T: Payload> fmt::Debug for Publisher<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Publisher").field("path", &self.path()).finish_non_exhaustive()
    }
}
