//! What `robot!` declares, as constant data.

mod command;
mod estimator;
mod graph;
mod join;
mod parameter;
mod quantity;
mod source;

pub use command::{Cancel, CommandDeclaration, Role};
pub use estimator::{
    EstimatorDeclaration, HealthDeclaration, InletDeclaration, InputDeclaration, IslandDeclaration,
    WorkerDeclaration,
};
pub use graph::graph;
pub use join::join;
pub use parameter::{ParameterDeclaration, ParameterDefault, ParameterError, ParameterType, ParameterValues};
pub use quantity::{Dimension, Range};
pub use source::{ActuatorDeclaration, SensorDeclaration, Supervisor};
