//! What a user implements: sensors, estimators, actuators, services and commands; their options, inputs and outputs, and
//! what each is given when it starts.

mod actuator;
pub(crate) mod binding;
mod bus;
mod command;
mod context;
mod estimator;
mod external;
mod guardian;
mod host;
mod info;
pub(crate) mod inputs;
pub(crate) mod options;
pub(crate) mod outputs;
mod permit;
mod record;
mod sensor;
mod service;
pub(crate) mod setting;

pub(crate) use crate::fault::Fault;
pub(crate) use actuator::Accepts;
pub use actuator::{Actuator, ActuatorError};
pub(crate) use binding::Binding;
pub(crate) use bus::AnyExecution;
pub use bus::{ActuatorLink, Bus, CommandInfo, DynamicExecution};
pub use command::{Arm, Command, CommandContext, Disarm, NoArguments, Outcome, Sleep};
pub use context::{ActuatorContext, ComponentContext, Context, SensorContext, ServiceContext};
pub use estimator::{Estimator, HandleCall, HandleCast, Reply};
pub use external::External;
pub use guardian::SafetyLink;
pub(crate) use guardian::{DisarmHook, Guardian, OwnHooks};
pub(crate) use host::Host;
pub use info::{Info, Request};
pub(crate) use inputs::{At, FieldIndex, InputAt, SyncMiss, TakenAt};
pub use inputs::{Input, InputField, Inputs};
pub(crate) use options::FromQuantity;
pub use options::{NoOptions, OptionField, Options};
pub use outputs::Outputs;
pub(crate) use outputs::{EmittedAt, OutputAt};
pub(crate) use permit::Permit;
pub use record::RequestCodec;
pub use sensor::{Next, Reading, Sensor};
pub use service::Service;
pub(crate) use setting::{AnyOptions, Setting, SettingKind, quantity};
