//! A robot that runs: assembled by a [`Builder`], driven by real sensors in threads ([`Running`]) or on virtual time
//! by whoever calls it ([`Simulation`]).

mod builder;
mod error;
mod handle;
mod machine;
mod report;
mod robot;
mod running;
mod simulation;
mod source;
mod startup;
mod stop;

pub use builder::Builder;
pub use error::{ComponentFault, StartError};
pub(crate) use error::{Failed, caught, retire};
pub use handle::{Configurable, EstimatorHandle, EstimatorOfSeveralHandle, OutputHandle, Publisher, SensorHandle};
pub use report::Report;
pub use robot::Robot;
pub use running::Running;
pub use simulation::Simulation;
pub use source::{SensorDeclaration, Source};
pub use startup::Startup;
pub(crate) use stop::StopSignal;
