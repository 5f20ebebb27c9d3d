//! Publish and subscribe. A slow subscriber never slows a publisher and never grows without bound.

mod queue;
mod subscription;
mod topic;

pub use queue::Overflow;
pub use subscription::{RecvAsync, Subscription};
pub use topic::{AnyTopic, Topic, TopicStatistics};
