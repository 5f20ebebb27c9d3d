//! What a user implements: sensors, estimators, actuators, services and commands; their options, inputs and outputs, and
//! what each is given when it starts.

mod actuator;
mod binding;
mod bus;
mod command;
mod context;
mod estimator;
mod external;
mod guardian;
mod host;
mod info;
mod inputs;
mod options;
mod outputs;
mod permit;
mod record;
mod sensor;
mod service;
mod setting;
mod template;

pub(crate) use crate::fault::Fault;
pub(crate) use actuator::Accepts;
pub use actuator::{Actuator, ActuatorError};
pub use binding::{Binding, FromParameter};
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
pub use inputs::{At, FieldIndex, Input, InputAt, InputField, Inputs, Slot, SyncMiss, TakenAt, declare};
pub use options::{FromQuantity, FromText, NoOptions, OptionField, Options};
pub use outputs::{EmittedAt, OutputAt, Outputs};
pub(crate) use permit::Permit;
pub use record::RequestCodec;
pub use sensor::{Next, Reading, Sensor};
pub use service::Service;
pub(crate) use setting::quantity;
pub use setting::{AnyOptions, ByCode, ByText, ByValue, Setting, SettingKind, SettingOf, WithUnit};
pub(crate) use template::Template;
