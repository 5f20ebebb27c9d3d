//! Publish and subscribe. A slow subscriber never slows a publisher and never grows without bound.

mod dynamic;
mod queue;
mod select;
mod subscription;
#[cfg(test)]
mod tests;
mod topic;
mod wakers;

pub use dynamic::{DynamicMessage, DynamicSubscription};
pub use queue::Overflow;
pub use select::{Payloads, Select};
pub use subscription::{RecvAsync, Subscription};
pub use topic::{AnyTopic, SubscriberStatistics, Topic, TopicStatistics};
#[allow(unused_imports, reason = "for publishers that hold a lock of the robot")]
pub(crate) use wakers::Wakers;
