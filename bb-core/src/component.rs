//! The traits that a user implements: sensors, estimators, actuators, services and commands; their options, inputs
//! and outputs, and the context of each.

mod actuator;
mod actuator_link;
pub(crate) mod binding;
mod bus;
mod caller;
mod command;
mod context;
mod counter;
mod description;
mod estimator;
mod execution;
mod external;
pub(crate) mod field;
mod guardian;
mod host;
mod info;
pub(crate) mod inputs;
mod joint_publisher;
mod motion_reports;
pub(crate) mod options;
mod parameter_store;
mod reaction;
mod record;
pub(crate) mod reference;
pub(crate) mod replacement;
mod sensor;
mod service;
pub(crate) mod setting;
pub(crate) mod shared;
mod template;
mod tenure;
mod transforms;

pub(crate) use crate::fault::{Fault, Termination};
pub use actuator::Actuator;
pub(crate) use actuator_link::{Accepts, AcceptsJson};
pub use actuator_link::{ActuatorError, ActuatorLink};
pub(crate) use bb_message::outputs::EmittedAt;
pub use bb_message::outputs::{Outputs, Timed};
pub(crate) use binding::Binding;
pub use bus::{Bus, DisarmQueue, Session};
pub(crate) use caller::Caller;
pub use command::{Arm, Command, CommandContext, Disarm, NoArguments, Outcome, Sleep};
pub use context::{ActuatorContext, ComponentContext, Context, SensorContext, ServiceContext};
pub use counter::Counter;
pub(crate) use counter::Counts;
pub use description::{
    ComponentDescription, ComponentKind, Description, InputDescription, JointDescription, LinkDescription,
    ParameterDescription, RunKind, TopicDescription,
};
pub use estimator::{Estimator, HandleCall, HandleCast, Reply};
pub(crate) use execution::AnyExecution;
pub use execution::{ArgumentInfo, CommandInfo, DynamicExecution, ExecutionInfo};
pub use external::External;
pub(crate) use field::FromQuantity;
pub use field::OptionField;
pub use guardian::SafetyLink;
pub(crate) use guardian::{DisarmHook, Guardian};
pub(crate) use host::{CommandControls, Controls, ExternalSensor, Host, ParameterControls, SafetyControls};
pub use info::{Info, Request};
pub use inputs::{Every, Input, InputField, Inputs};
pub(crate) use inputs::{InputAt, SyncMiss, TakenAt};
pub use joint_publisher::JointPublisher;
pub(crate) use motion_reports::MotionReport;
pub(crate) use options::{AnyOptions, OptionsList};
pub use options::{NoOptions, Options};
pub use parameter_store::ParameterStore;
pub use reaction::{Reaction, ReactionEvent, ReactionOptions, ReactionState};
pub use record::RequestCodec;
pub use reference::{CommandPath, Number, TopicField};
pub use sensor::{Next, Reading, Sensor};
pub use service::{Service, StateReport};

pub(crate) use setting::{Setting, SettingKind, quantity};
pub(crate) use template::Template;
pub use transforms::{InputTransform, InputTransforms};
