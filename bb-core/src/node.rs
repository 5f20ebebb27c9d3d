//! A running estimator: what it was declared as, its fan-in, its counters.

mod admission;
mod counters;
mod declaration;
mod running;

pub use counters::{DropReason, EstimatorStatistics, InputStatistics};
pub use declaration::{EstimatorDeclaration, InputDeclaration};
pub use running::{AnyNode, Node};
