//! Running estimators (fan-in, health, timers and counters), and the islands in which they run.

mod act;
mod admission;
mod backlog;
mod count;
mod counters;
mod entry;
mod environment;
mod health;
mod island;
mod latency;
mod requests;
mod running;
mod shared;
mod timers;
mod timing;
mod turn;

pub use act::Act;
pub(crate) use act::Visit;
pub use counters::{DropReason, EstimatorStatistics, InputStatistics};
pub(crate) use entry::{HealthReport, NodeEntry, Report};
pub use environment::Environment;
pub(crate) use environment::{BindTarget, Check, EnvironmentParts, Missing, Mode, Overseer};
pub use island::{
    Alone, Inlet, Island, IslandOf, IslandState, IslandWiring, Key, Member, Solo, act, alone, emit, enter,
    enter_alone, hold, island as island_of, publish_to, receive, start, start_alone,
};
pub(crate) use island::{AnyIsland, CallError, Replayed};
pub use latency::LatencyStatistics;
pub(crate) use requests::{know_calls, know_casts};
pub use running::Node;
pub(crate) use running::{Arrival, Next};
pub(crate) use shared::SharedNode;
pub use turn::Turn;
