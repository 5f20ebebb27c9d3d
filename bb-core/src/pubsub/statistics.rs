//! The counts of topics and subscriptions.

/// One subscriber of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SubscriberStatistics {
    /// `true` if the subscriber knows the payload's type.
    pub is_typed: bool,
    /// Messages waiting for it.
    pub waiting: usize,
    /// Number of messages that may wait.
    pub capacity: usize,
    /// Bytes of the waiting messages that count towards the bound: see [`Overflow`](super::Overflow).
    pub bytes: usize,
    /// Messages it lost because it was slow; none if it keeps the newest alone.
    pub lost: u64,
}

/// The counts of a topic since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TopicStatistics {
    /// Path of the topic.
    pub path: &'static str,
    /// The name of its payload's type.
    pub payload: &'static str,
    /// Messages published.
    pub published: u64,
    /// Messages that subscribers lost because they were slow, or read only after more had arrived than they keep. Those that keep the
    /// newest alone lose none.
    pub lost: u64,
    /// Wakers of subscriptions that panicked when they were woken by a publisher.
    pub panics: u64,
    /// Current subscriptions.
    pub subscribers: usize,
}
