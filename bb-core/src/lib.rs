//! State estimation for robots that are *declared*.
//!
//! A robot is one [`robot!`]: links, joints, sensors, estimators. The macro checks as much as possible at compile
//! time and expands to typed static wiring over this crate, the runtime:
//!
//! | what | where |
//! |---|---|
//! | time, real or virtual | [`time`] |
//! | messages: a payload with its time, frame and origin; as bytes | [`message`], [`payload`], [`message::codec`] |
//! | subscriptions | [`pubsub`] |
//! | links, joints and the transforms between them | [`topology`] |
//! | the poses and motions of a robot's links | [`kinematics`] |
//! | the known states of a running robot's joints, and its frames at any time | [`joints`] |
//! | events that the runtime publishes about itself | [`event`] |
//! | the declarations of `robot!` | [`declaration`] |
//! | the journal of a run, and its replay | [`journal`], [`Replay`] |
//! | the events for telemetry handlers | [`telemetry`] |
//! | the traits that a user implements: [`Sensor`], [`Estimator`], [`Actuator`], [`Service`], [`Command`], and the
//! derives for options, inputs, outputs, payloads | [`component`] |
//! | start, run, stop; the handles of declared items; statistics and errors of a run | [`run`] |
//!
//! Each module uses only those above it in this table.
//!
//! ```
//! use bb_core::prelude::*;
//!
//! robot! {
//!     robot Kite;
//!     link body { sensor imu: External<Imu>(); }
//! }
//!
//! fn main() -> Result<(), StartError> {
//!     let builder = Kite::builder();
//!     let samples = builder.subscribe(kite::sensor::body::imu);
//!     let mut simulation = builder.simulate()?; // or `start()`, in real time
//!     let sample = Imu::new([0.0; 3].into(), [0.0, 0.0, 9.81].into());
//!     simulation.publish(kite::sensor::body::imu, simulation.clock().now(), sample);
//!     assert_eq!(samples.drain().count(), 1);
//!     Ok(())
//! }
//! ```
//!
//! Filters are in `bb-estimators`, recordings in `bb-mcap`. The book in `book/` has a tutorial.
//!
//! All stored quantities are SI: metres, seconds, radians, kilograms, tesla.

// A robot must not stop because a value was not what it was assumed to be.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]
#![cfg_attr(loom, allow(dead_code, reason = "a model is of a part"))]

// The derives name this crate by its absolute path, also when this crate itself uses them.
extern crate self as bb_core;

pub mod component;
pub mod declaration;
pub mod event;
pub mod joints;
pub mod journal;
pub mod pubsub;
pub mod run;
pub mod telemetry;

#[allow(clippy::panic, reason = "a fault is a panic at compile time, which rustc reports")]
mod check;
mod control;
mod fault;
mod lifecycle;
mod node;
mod schedule;
mod stub;

#[doc(inline)]
pub use bb_kinematics::{kinematics, topology};
#[doc = include_str!("robot.md")]
pub use bb_macros::robot;
pub use bb_macros::{Inputs, Options, Outputs};
#[doc(inline)]
pub use bb_message::{message, payload, time};
pub use component::{
    Actuator, ActuatorContext, Bus, Command, CommandContext, Context, Estimator, Every, HandleCall, HandleCast,
    Info, Input, Inputs, Options, Outcome, Outputs, Reading, Reply, Request, RequestCodec, SafetyLink, Sensor,
    SensorContext, Service, ServiceContext, Session, Timed,
};
pub use declaration::{ParameterError, Role};
pub use event::{
    ArmError, ComponentFault, DisarmError, Forbidden, HardwareError, HardwareErrorKind, HealthReason, HealthState,
    HealthTransition, ParameterValue, Refusal, Right, Rights, Safety,
};
pub use fault::{Fault, Termination};
pub use message::{
    Exceeded, Field, Finite, Frame, JointBounds, JointCommand, JointPositions, JointReading, JointSide,
    LimitedQuantity, Origin, OutOfBounds, Payload, Stamped,
};
pub use pubsub::{
    Delivery, DynamicMessage, DynamicSubscription, Overflow, Payloads, Publisher, Select, Subscription, Unmatched,
};
pub use run::{
    ActuatorHandle, Builder, CommandHandle, EstimatorHandle, EstimatorOfSeveralHandle, Execution, Live,
    OutputHandle, ParameterHandle, Replay, ReplayError, Report, Robot, Running, SensorHandle, SettingProblem,
    SettingsError, SettingsList, Simulation, StartError,
};
/// Handles of the topics that every robot has: subscribe to them as to any other.
pub mod system {
    pub use crate::run::{Faults, Health, JournalLines, SafetyErrors, SafetyState, StateMachine};
}
pub use telemetry::TelemetryEvent;
pub use time::{Clock, MonotonicTime, WallTime};

pub use nalgebra;

/// Everything a file that declares or runs a robot needs: `use bb_core::prelude::*;`.
pub mod prelude {
    pub use crate::component::{
        Actuator, ActuatorContext, Arm, Command, CommandContext, Context, Disarm, Estimator, Every, External,
        HandleCall, HandleCast, Info, Input, NoArguments, NoOptions, Outcome, Reaction, Reading, Reply, Request,
        SafetyLink, Sensor, SensorContext, Service, ServiceContext, Timed,
    };
    pub use crate::declaration::Role;
    pub use crate::event::{
        HardwareError, HardwareErrorKind, HealthReason, HealthState, HealthTransition, Right, Rights, Safety,
    };
    pub use crate::fault::{Fault, Termination};
    pub use crate::message::{JointSide, RosMessage, Stamped};
    pub use crate::payload::*;
    pub use crate::pubsub::{Overflow, Select, Subscription};
    pub use crate::robot;
    pub use crate::run::{Live, Robot, Running, Simulation, StartError};
    pub use crate::system;
    pub use crate::time::{Clock, MonotonicTime, WallTime};
    // The traits and the derives of the same names.
    pub use crate::{Inputs, Options, Outputs, Payload};
    pub use std::time::Duration;
}

/// Items used by the expansions of the macros. Not for users: they change without notice.
#[doc(hidden)]
pub mod __private {
    pub use crate::__stub_robot as stub_robot;
    pub use crate::check::{
        check_compared, check_dynamic, check_estimator, check_input, check_nested, check_number, check_optional,
        check_output, check_position, check_quantity, check_reachable, check_required, check_role, find_input,
        find_output,
    };
    pub use crate::component::binding::{Binding, FromParameter};
    pub use crate::component::field::{FromPath, FromQuantity, FromText};
    pub use crate::component::inputs::{EverySlot, InputAt, LatestSlot, Slot, SyncMiss, TakenAt, declare};
    pub use crate::component::options::OptionsList;
    pub use crate::component::reference::number_of;
    pub use crate::component::setting::{ByCode, ByText, ByValue, Setting, SettingOf, WithUnit};
    pub use crate::component::{Command, CommandPath, Every, Input, InputField, OptionField, TopicField};
    pub use crate::control::Prepared;
    pub use crate::declaration::estimator::{InletDeclaration, IslandDeclaration};
    pub use crate::declaration::join::join;
    pub use crate::declaration::parameter::ParameterValues;
    pub use crate::declaration::{
        ActuatorDeclaration, Cancel, CommandDeclaration, Dimension, EstimatorDeclaration, HealthDeclaration,
        InputDeclaration, ParameterDeclaration, ParameterDefault, Range, SensorDeclaration, WorkerDeclaration,
    };
    pub use crate::event::CategoryDeclaration;
    pub use crate::lifecycle::Serving;
    pub use crate::message::{BothKnown, Feeds, Finite, Frame, Stamp};
    pub use crate::node::{
        Act, Alone, Environment, Inlet, Island, IslandOf, IslandState, IslandWiring, Key, Member, Node, Solo, Turn,
        act, alone, emit, enter, enter_alone, hold, island_of, publish_to, receive, start, start_alone,
    };
    pub use crate::pubsub::{AnyTopic, DynamicMessage, Topic};
    pub use crate::run::actuator::{ActuatorNode, AnyActuator};
    pub use crate::run::source::{Assembly, Sources};
    pub use crate::run::{
        ActuatorHandle, BridgeHandle, CommandHandle, ControllerHandle, EstimatorHandle, EstimatorOfSeveralHandle,
        OutputHandle, ParameterHandle, Report, Robot, SensorHandle, StartError,
    };
    pub use crate::stub::{
        Known, NoField, NotProbed, Probe, Probed, Unknown, as_known, both_known, implemented, stub,
    };
    pub use crate::time::MonotonicTime;
    pub use crate::topology::{
        Collision, Dynamics, Geometry, Inertial, Joint, JointKind, Limit, Link, Material, Mimic, Origin, Topology,
        Transform, Transmission, Visual,
    };
    pub use bb_message::__private::{
        DecodeError, EnumShape, Exceeded, FieldOf, FieldShape, FieldUnit, JointBounds, JointCommand,
        JointPositions, JointReading, NotField, OutOfBounds, Reader, RosLayout, Shape, Stamped, StructShape,
        Writer, is_any, is_finite,
    };
    pub use bb_message::outputs::{At, EmittedAt, FieldIndex, OutputAt, OutputField};
    pub use std::convert::identity;
    pub use std::sync::Arc;
    // Aliases for code that is generated for every component.
    pub use std::boxed::Box;
    pub use std::clone::Clone;
    pub use std::default::Default;
    pub use std::option::Option::{self, None, Some};
    pub use std::vec::Vec;
}
