//! What topics and subscriptions have counted.

/// One subscriber of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SubscriberStatistics {
    /// Whether it knows the payload's type.
    pub is_typed: bool,
    /// Messages that wait for it.
    pub waiting: usize,
    /// How many may wait.
    pub capacity: usize,
    /// Bytes of the messages that wait, as far as they count towards the bound: see [`Overflow`](super::Overflow).
    pub bytes: usize,
    /// Messages it lost because it was slow.
    pub lost: u64,
}

/// What a topic has counted since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TopicStatistics {
    /// Its path.
    pub path: &'static str,
    /// The name of its payload's type.
    pub payload: &'static str,
    /// Messages published.
    pub published: u64,
    /// Messages that subscribers lost because they were slow, or read only after more had come than they keep.
    pub lost: u64,
    /// Subscriptions that listen now.
    pub subscribers: usize,
}
