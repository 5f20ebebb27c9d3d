//! Events that the runtime publishes on its own topics.

mod arming;
mod command;
mod fault;
mod health;
mod parameter;
mod rights;
mod safety;

pub use arming::{ArmError, DisarmError};
pub use command::{CategoryDeclaration, CommandEvent, CommandPhase, Refusal, RefusalReason, StateTransition};
pub use fault::ComponentFault;
pub use health::{HealthReason, HealthState, HealthTransition};
pub use parameter::{ParameterChange, ParameterValue};
pub use rights::{Forbidden, Right, Rights};
pub use safety::{HardwareError, HardwareErrorKind, Quantity, Safety, SafetyError, SafetyTransition};
