//! Publish and subscribe. A slow subscriber never slows a publisher and never grows without bound.

mod any;
mod bound;
mod delivery;
mod dynamic;
mod publisher;
mod queue;
mod registry;
mod select;
mod statistics;
mod subscribers;
mod subscription;
#[cfg(test)]
mod tests;
mod timer;
mod topic;
mod typed;
mod unmatched;
mod wakers;

pub use any::{AnyTopic, DynamicMessage, Encoded};
pub(crate) use bound::{Bound, Held, counted_bytes, is_counted};
pub use delivery::{Delivery, Overflow};
pub use dynamic::{DynamicSubscription, RecvDynamic};
pub use publisher::Publisher;
pub(crate) use publisher::{Enter, Gate, Tell};
pub(crate) use registry::Registry;
pub use select::{Payloads, Select};
pub use statistics::{SubscriberStatistics, TopicStatistics};
pub use subscription::{RecvAsync, Subscription};
pub(crate) use timer::Alarms;
pub use topic::Topic;
pub use unmatched::Unmatched;
pub(crate) use unmatched::unmatched_at;
pub(crate) use wakers::Wakers;
