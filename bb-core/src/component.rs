//! What a user implements: sensors, estimators, actuators, controllers and bridges; their options, inputs and outputs.

mod actuator;
mod context;
mod estimator;
mod external;
mod fault;
mod info;
mod inputs;
mod options;
mod outputs;
mod sensor;
mod service;

pub use actuator::{Actuator, ActuatorContext};
pub use context::{Context, SensorContext};
pub use estimator::{Estimator, HandleCall, HandleCast, Reply};
pub use external::External;
pub use fault::Fault;
pub(crate) use fault::Then;
pub use info::{Info, Request};
pub use inputs::{FieldIndex, Input, InputAt, InputField, Inputs, Slot, SyncMiss, declare};
pub use options::{Dimension, FromQuantity, FromText, NoOptions, OptionField, Options, Range};
pub use outputs::{OutputAt, Outputs};
pub use sensor::{Next, Reading, Sensor};
pub use service::{Bridge, Controller, ServiceContext};
