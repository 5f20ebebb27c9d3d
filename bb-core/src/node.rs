//! A running estimator: what it was declared as, its fan-in, its health, its counters; and the islands in which
//! estimators run.

mod admission;
mod counters;
mod declaration;
mod health;
mod island;
mod latency;
mod running;
mod shared;
mod timers;

pub use counters::{DropReason, EstimatorStatistics, InputStatistics};
pub use declaration::{
    EstimatorDeclaration, HealthDeclaration, InputDeclaration, IslandDeclaration, WorkerDeclaration,
};
pub use health::{HealthReason, HealthState, HealthTransition};
pub use island::{AnyIsland, Held, Island, Key, Sea, Shore};
pub use latency::LatencyStatistics;
pub use running::{Node, Turn};
pub(crate) use shared::SharedNode;
