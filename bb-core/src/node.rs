//! Running estimators (fan-in, health, timers and counters), and the islands in which they run.

mod admission;
mod backlog;
mod count;
mod counters;
mod emission;
mod entry;
mod environment;
mod health;
mod island;
mod latency;
mod mark;
mod requests;
mod running;
mod shared;
mod timers;
mod timing;
mod turn;

pub use counters::{DropReason, EstimatorStatistics, InputStatistics};
pub(crate) use emission::{Emitting, blame, contained, contained_outside};
pub(crate) use entry::{HealthReport, NodeEntry, Report};
pub use environment::Environment;
pub(crate) use environment::{BindTarget, Check, EnvironmentParts, Missing, Mode, Overseer};
pub use island::{
    Act, Alone, Inlet, Island, IslandOf, IslandState, IslandWiring, Key, Member, Solo, act, alone, emit, enter,
    enter_alone, island as island_of, publish_to, receive, start, start_alone,
};
pub(crate) use island::{AnyIsland, CallError, Replayed, Visit, islands_in};
pub use latency::LatencyStatistics;
pub(crate) use requests::{know_calls, know_casts};
pub(crate) use running::Next;
pub use running::Node;
pub(crate) use shared::SharedNode;
pub use turn::Turn;
