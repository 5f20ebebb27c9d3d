//! Publish and subscribe. A slow subscriber never slows a publisher and never grows without bound.

mod dynamic;
mod publisher;
mod queue;
mod registry;
mod select;
mod subscription;
#[cfg(test)]
mod tests;
mod topic;
mod unmatched;
mod wakers;

pub use dynamic::{DynamicMessage, DynamicSubscription};
pub(crate) use publisher::Gate;
pub use publisher::Publisher;
pub use queue::Overflow;
pub(crate) use registry::Registry;
pub use select::{Payloads, Select};
pub use subscription::{RecvAsync, Subscription};
pub use topic::{AnyTopic, SubscriberStatistics, Topic, TopicStatistics};
pub use unmatched::Unmatched;
pub(crate) use unmatched::unmatched_at;
pub(crate) use wakers::Wakers;
