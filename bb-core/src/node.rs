//! A running estimator: what comes in, what goes out, its fan-in, health, timers and counters; and the islands in which
//! estimators run.

mod admission;
mod backlog;
mod counters;
mod emission;
mod entry;
mod environment;
mod health;
mod island;
mod latency;
mod requests;
mod running;
mod shared;
mod timers;
mod turn;

pub use counters::{DropReason, EstimatorStatistics, InputStatistics};
pub(crate) use emission::{Emitting, blame, contained, contained_outside};
pub use entry::NodeEntry;
pub(crate) use entry::{HealthReport, Report};
pub use environment::Environment;
pub(crate) use environment::{BindTarget, Check, EnvironmentParts, Mode, Overseer};
pub(crate) use island::CallError;
pub use island::{
    Act, AnyIsland, Island, IslandState, IslandWiring, Key, Member, Replayed, act, alone, enter, feed,
    island as island_of, receive, start,
};
pub(crate) use island::{publish, take_turn};
pub use latency::LatencyStatistics;
pub(crate) use requests::{know_calls, know_casts};
pub use running::{Next, Node};
pub(crate) use shared::SharedNode;
pub use turn::Turn;

pub use crate::event::{HealthReason, HealthState, HealthTransition};
