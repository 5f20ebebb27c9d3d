//! Declarations of `robot!`, as constant data.

mod command;
pub(crate) mod estimator;
mod graph;
pub(crate) mod join;
pub(crate) mod parameter;
mod quantity;
mod robot;
pub(crate) mod schema;
mod source;
pub(crate) mod unit;

pub use command::{Cancel, CommandDeclaration, Role};
pub(crate) use estimator::IslandDeclaration;
pub use estimator::{EstimatorDeclaration, HealthDeclaration, InputDeclaration, WorkerDeclaration};
pub(crate) use graph::graph;
pub use parameter::{ParameterDeclaration, ParameterDefault, ParameterError, ParameterType};
pub(crate) use parameter::{ParameterValues, parameter_from_json};
pub use quantity::{Dimension, Range};
pub(crate) use robot::RobotDeclaration;
pub use source::{ActuatorDeclaration, SensorDeclaration, Supervisor};
