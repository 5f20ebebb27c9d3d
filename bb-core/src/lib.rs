//! State estimation for robots that are *declared*.
//!
//! A robot is one [`robot!`]: links, joints, sensors, estimators. The macro checks what can be checked at compile
//! time and expands to typed static wiring over this crate, the runtime:
//!
//! | what | where |
//! |---|---|
//! | messages: a payload with its time, frame and origin; as bytes | [`message`], [`payload`], [`message::codec`] |
//! | what a user implements: [`Sensor`], [`Estimator`], [`Actuator`], [`Controller`], [`Bridge`], [`Command`], and the derives for options, inputs, outputs, payloads | [`component`] |
//! | time, real or virtual | [`time`] |
//! | links, joints and the transforms between them | [`topology`] |
//! | a running estimator: fan-in, health, drops, counters | [`node`] |
//! | states, commands, parameters, safety | [`control`] |
//! | subscriptions | [`pubsub`] |
//! | what came in, to run it again | [`journal`] |
//! | start, run, stop | [`run`] |
//!
//! All stored quantities are SI: metres, seconds, radians, kilograms, tesla.

// The derives name this crate by its absolute path, also when this crate itself uses them.
extern crate self as bb_core;

pub mod component;
pub mod control;
pub mod journal;
pub mod message;
pub mod node;
pub mod payload;
pub mod pubsub;
pub mod run;
pub mod time;
pub mod topology;

mod check;
mod stub;

#[doc = include_str!("robot.md")]
pub use bb_macros::robot;
pub use bb_macros::{Inputs, Options, Outputs, Payload};
pub use component::{
    Actuator, ActuatorContext, Bridge, Context, Controller, Estimator, Fault, HandleCall, HandleCast, Info, Input,
    Inputs, Options, Outputs, Reading, Reply, Request, Sensor, SensorContext, ServiceContext,
};
pub use control::{
    Command, CommandContext, Execution, Outcome, ParameterError, ParameterValue, Refusal, Role, Safety,
};
pub use message::{Field, Finite, Frame, Origin, Payload, Stamped};
pub use node::{HealthReason, HealthState, HealthTransition};
pub use pubsub::{
    DynamicMessage, DynamicSubscription, Overflow, Payloads, Publisher, Select, Subscription, Unmatched,
};
pub use run::{
    ActuatorHandle, Builder, Bus, CommandHandle, EstimatorHandle, EstimatorOfSeveralHandle, Live, OutputHandle,
    ParameterHandle, Replay, ReplayError, Report, Robot, Running, SensorHandle, Simulation, StartError,
};
/// Handles of the topics that every robot has: subscribe to them as to any other.
pub mod system {
    pub use crate::run::{Health, JournalLines, SafetyErrors, SafetyState, StateMachine};
}
pub use time::{Clock, MonotonicTime, WallTime};

pub use nalgebra;

/// Everything a file that declares or runs a robot needs: `use bb_core::prelude::*;`.
pub mod prelude {
    pub use crate::component::{
        Actuator, ActuatorContext, Bridge, Context, Controller, Estimator, External, Fault, HandleCall, HandleCast,
        Info, Input, NoOptions, Reading, Reply, Request, Sensor, SensorContext, ServiceContext,
    };
    pub use crate::control::{Arm, Command, CommandContext, Disarm, NoArguments, Outcome, Role, Safety};
    pub use crate::message::{RosMessage, Stamped};
    pub use crate::node::{HealthReason, HealthState, HealthTransition};
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

/// What the expansions of the macros name. Not for users: it changes without notice.
#[doc(hidden)]
pub mod __private {
    pub use crate::__stub_robot as stub_robot;
    pub use crate::check::{
        Given, check_divergence, check_dynamic, check_input, check_inputs, check_nested, check_option,
        check_optional, check_output, check_outputs, check_reachable, check_required, check_role, find_input,
        find_nested, find_output,
    };
    pub use crate::component::{
        Dimension, FieldIndex, FromQuantity, FromText, Input, InputAt, InputField, OptionField, OutputAt, Range,
        Slot, SyncMiss, declare,
    };
    pub use crate::control::{
        Binding, Cancel, CategoryDeclaration, Command, CommandDeclaration, FromParameter, ParameterDeclaration,
        ParameterDefault, ParameterValues, Prepared,
    };
    pub use crate::journal::Journal;
    pub use crate::message::codec::{
        DecodeError, EnumShape, FieldOf, FieldShape, NotField, Reader, RosLayout, Shape, StructShape, Writer,
        is_any, is_finite,
    };
    pub use crate::message::{Feeds, Finite, Frame, Stamp, Stamped};
    pub use crate::node::{
        AnyIsland, EstimatorDeclaration, HealthDeclaration, Held, InputDeclaration, Island, IslandDeclaration, Key,
        Node, Sea, Shore, Turn, WorkerDeclaration,
    };
    pub use crate::pubsub::{AnyTopic, DynamicMessage, Topic};
    pub use crate::run::{
        ActuatorDeclaration, ActuatorHandle, ActuatorNode, AnyActuator, AsBridge, AsController, AsSensor,
        BridgeHandle, CommandHandle, ControllerHandle, EstimatorHandle, EstimatorOfSeveralHandle, FeedOf, IslandOf,
        OutputHandle, ParameterHandle, Periodic, Report, Robot, SensorDeclaration, SensorHandle, Source,
        StartError, Startup, Visit,
    };
    pub use crate::stub::{Known, NotProbed, Probe, Unknown, as_known, both_known, stub};
    pub use crate::time::MonotonicTime;
    pub use crate::topology::{
        Collision, Dynamics, Geometry, Inertial, Joint, JointKind, Limit, Link, Material, Mimic, Origin, Topology,
        Transform, Transmission, Visual,
    };
    pub use std::sync::Arc;
}
