//! Messages of any payload, by path: for loggers, dashboards, recorders.

use super::queue::Queue;
use super::{AnyTopic, Overflow};
use crate::message::{Payload, Stamp, Stamped};
use std::any::Any;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// A message whose payload's type is known only to whoever asks for it. Clones are the same message.
#[derive(Clone)]
pub struct DynamicMessage {
    path: &'static str,
    message: Arc<dyn AnyMessage>,
}

trait AnyMessage: Send + Sync {
    fn payload_name(&self) -> &'static str;
    fn stamp(&self) -> Stamp;
    fn as_any(&self) -> &dyn Any;
    fn fmt_payload(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

impl<T: Payload> AnyMessage for Stamped<T> {
    fn payload_name(&self) -> &'static str {
        T::NAME
    }
    fn stamp(&self) -> Stamp {
        Stamped::stamp(self)
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn fmt_payload(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&self.payload, f)
    }
}

impl DynamicMessage {
    pub(super) fn new<T: Payload>(path: &'static str, message: &Stamped<T>) -> Self {
        Self { path, message: Arc::new(message.clone()) }
    }

    /// The path it was published at.
    pub fn path(&self) -> &'static str {
        self.path
    }

    /// The name of its payload's type.
    pub fn payload_name(&self) -> &'static str {
        self.message.payload_name()
    }

    /// When it was measured, in which frame, and where.
    pub fn stamp(&self) -> Stamp {
        self.message.stamp()
    }

    /// The message, if its payload is a `T`.
    pub fn downcast<T: Payload>(&self) -> Option<&Stamped<T>> {
        self.message.as_any().downcast_ref()
    }
}

impl fmt::Debug for DynamicMessage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} ", self.path, self.stamp().monotonic_time)?;
        self.message.fmt_payload(f)
    }
}

/// The queue of such a subscriber, for a topic to hand messages to.
#[doc(hidden)]
#[derive(Clone, Debug)]
pub struct Tap(pub(super) Arc<Queue<DynamicMessage>>);

/// Which paths to subscribe to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Select<'a> {
    /// All of them.
    All,
    /// One.
    Path(&'a str),
    /// One, and all below it: `sensor/base_link`.
    Below(&'a str),
}

impl Select<'_> {
    /// Whether it includes `path`.
    pub fn includes(self, path: &str) -> bool {
        match self {
            Self::All => true,
            Self::Path(selected) => path == selected,
            Self::Below(above) => {
                path.strip_prefix(above).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            }
        }
    }
}

/// The messages of all selected publishers, in the order in which they were published. Dropping it unsubscribes.
#[derive(Debug)]
pub struct DynamicSubscription {
    queue: Arc<Queue<DynamicMessage>>,
    paths: Vec<&'static str>,
}

impl DynamicSubscription {
    /// Subscribes to those `topics` that are selected and whose payload's type has the name `payload`, if one is given.
    pub fn new<'a>(
        topics: impl IntoIterator<Item = &'a dyn AnyTopic>,
        select: Select<'_>,
        payload: Option<&str>,
        overflow: Overflow,
    ) -> Self {
        let queue = Arc::new(Queue::new(overflow));
        let mut paths = Vec::new();
        for topic in topics {
            if select.includes(topic.path()) && payload.is_none_or(|name| name == topic.payload_name()) {
                topic.tap(&Tap(Arc::clone(&queue)));
                paths.push(topic.path());
            }
        }
        Self { queue, paths }
    }

    /// The paths it listens to.
    pub fn paths(&self) -> &[&'static str] {
        &self.paths
    }

    /// The oldest message that waits, if any.
    pub fn try_recv(&self) -> Option<DynamicMessage> {
        self.queue.pop()
    }

    /// Waits for the next message, `timeout` at most; none after that. (It does not end by itself when the robot stops,
    /// since its publishers do so one by one.)
    pub fn recv_timeout(&self, timeout: Duration) -> Option<DynamicMessage> {
        self.queue.wait(Some(timeout))
    }

    /// The messages that wait now; those that arrive meanwhile are left.
    pub fn drain(&self) -> impl Iterator<Item = DynamicMessage> + '_ {
        (0..self.queue.len()).map_while(|_| self.try_recv())
    }

    /// How many messages were lost because this subscriber was slow.
    pub fn lagged(&self) -> u64 {
        self.queue.lagged()
    }
}

impl Drop for DynamicSubscription {
    fn drop(&mut self) {
        // Its topics let go of it at their next message.
        self.queue.abandon();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_silent_topic_forgets_those_who_have_left() {
        let topic = super::super::Topic::<crate::payload::JointState>::new("sensor/arm/encoder");
        let listen =
            || DynamicSubscription::new([&topic as &dyn AnyTopic], Select::All, None, Overflow::KeepLatest);
        let left: Vec<_> = (0..100).map(|_| Arc::downgrade(&listen().queue)).collect();
        let _last = listen();
        assert_eq!(left.iter().filter(|queue| queue.strong_count() > 0).count(), 0);
    }

    #[test]
    fn a_subtree_ends_at_whole_names() {
        let below = Select::Below("sensor/base");
        assert!(below.includes("sensor/base") && below.includes("sensor/base/imu"));
        assert!(!below.includes("sensor/base_link/imu") && !below.includes("estimator/sensor/base"));
        assert!(Select::All.includes("anything") && !Select::Path("a").includes("a/b"));
    }
}
