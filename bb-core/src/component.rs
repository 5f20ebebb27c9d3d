//! What a user implements: sensors, estimators, their options, inputs and outputs.

mod context;
mod estimator;
mod external;
mod fault;
mod inputs;
mod options;
mod outputs;
mod sensor;

pub use context::{Context, SensorContext};
pub use estimator::{Estimator, Reply};
pub use external::External;
pub use fault::Fault;
pub use inputs::{FieldIndex, Input, InputAt, InputField, Inputs, Slot, SyncMiss};
pub use options::{Dimension, FromQuantity, FromText, NoOptions, OptionField, Options, Range};
pub use outputs::{OutputAt, Outputs};
pub use sensor::{Next, Reading, Sensor};
