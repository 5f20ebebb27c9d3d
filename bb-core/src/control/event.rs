//! What is published on the system topics.

use super::{CategoryDeclaration, ParameterValue, Refusal, RefusalReason, Safety, SafetyError};
use crate::Payload;
use crate::message::codec::{EnumShape, FieldShape, Reader, Shape, StructShape, Writer};
use crate::message::{DecodeError, Field, Finite};
use crate::node::{HealthReason, HealthState, HealthTransition};
use crate::time::MonotonicTime;

/// A change of the operational state, at `state_machine`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct StateTransition {
    /// What it was.
    pub from: &'static str,
    /// What it is.
    pub to: &'static str,
    /// The command behind it, if one is.
    pub command: Option<&'static str>,
}

/// A change of the safety state, at `safety`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Payload)]
pub struct SafetyTransition {
    /// What it was.
    pub from: Safety,
    /// What it is.
    pub to: Safety,
}

/// A parameter that has changed, at its path: `param/imu/beta`.
#[derive(Clone, Debug, PartialEq, Payload)]
pub struct ParameterChange {
    /// Its path.
    pub path: &'static str,
    /// What it was.
    pub from: ParameterValue,
    /// What it is.
    pub to: ParameterValue,
}

/// What becomes of a command, at its path: `command/stop`.
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
pub struct CommandEvent {
    /// Its name.
    pub command: &'static str,
    /// The number of this execution; 0 if it was refused.
    pub execution: u64,
    /// What happened.
    pub phase: CommandPhase,
    /// The change of health that started it, if one did.
    pub health: Option<HealthTransition>,
}

/// See [`CommandEvent`].
#[derive(Clone, Debug, PartialEq, Eq, Payload)]
#[non_exhaustive]
pub enum CommandPhase {
    /// It runs.
    Started,
    /// It has come to its end.
    Succeeded,
    /// It has failed, and why.
    Failed(String),
    /// It took longer than its `timeout`.
    TimedOut,
    /// It was cancelled: by its caller, by another command, or since the robot was disarmed or stopped.
    Cancelled,
    /// It was not started, and why.
    Refused(Refusal),
}

impl Payload for SafetyError {
    const NAME: &'static str = "SafetyError";
}

impl Payload for HealthTransition {
    const NAME: &'static str = "HealthTransition";
}

/// Structs that these events are made of.
macro_rules! fields {
    ($($kind:ident { $($field:ident: $type:ty),* })*) => { $(
        impl Finite for $kind {
            fn is_finite(&self) -> bool {
                true
            }
        }

        impl Field for $kind {
            const SHAPE: Shape = Shape::Struct(&StructShape {
                name: stringify!($kind),
                fields: &[$(FieldShape::new(stringify!($field), <$type>::SHAPE)),*],
            });

            fn write(&self, writer: &mut Writer<'_>) {
                let Self { $($field),* } = self;
                $($field.write(writer);)*
            }

            fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                Ok(Self { $($field: reader.field(stringify!($field))?),* })
            }
        }
    )* };
}

/// Enums without fields that they are made of.
macro_rules! variants {
    ($($kind:ident { $($number:literal $variant:ident),* })*) => { $(
        impl Finite for $kind {
            fn is_finite(&self) -> bool {
                true
            }
        }

        impl Field for $kind {
            const SHAPE: Shape = Shape::Enum(&EnumShape {
                name: stringify!($kind),
                variants: &[$(StructShape { name: stringify!($variant), fields: &[] }),*],
            });

            fn write(&self, writer: &mut Writer<'_>) {
                let number = match self { $(Self::$variant => $number),* };
                writer.variant(number, 0);
            }

            fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
                match reader.variant()? {
                    $($number => Ok(Self::$variant),)*
                    other => reader.no_variant(other),
                }
            }
        }
    )* };
}

fields! {
    SafetyError { path: &'static str, message: String }
    CategoryDeclaration { name: &'static str, concurrency: usize }
    Refusal { command: &'static str, reason: RefusalReason, state: &'static str, category: CategoryDeclaration }
    HealthTransition {
        estimator: &'static str,
        source: &'static str,
        from: HealthState,
        to: HealthState,
        reason: HealthReason,
        time: MonotonicTime
    }
}

variants! {
    Safety { 0 Disarmed, 1 Armed, 2 Disarming, 3 Error }
    RefusalReason { 0 State, 1 Busy, 2 Safety, 3 Stopping }
    HealthState { 0 Healthy, 1 Degraded, 2 Lost }
    HealthReason {
        0 LatencyOverrun, 1 SyncMiss, 2 StaleInput, 3 Diverged, 4 Restarted, 5 Lost, 6 Recovered
    }
}

/// How a parameter's value is written.
#[derive(Clone, Debug, Payload)]
#[payload(name = "ParameterValue")]
enum Value {
    Bool(bool),
    Integer(i64),
    Float(f64),
    Text(String),
}

impl Finite for ParameterValue {
    fn is_finite(&self) -> bool {
        true
    }
}

impl Field for ParameterValue {
    const SHAPE: Shape = Value::SHAPE;

    fn write(&self, writer: &mut Writer<'_>) {
        let value = match self {
            Self::Bool(value) => Value::Bool(*value),
            Self::Integer(value) => Value::Integer(*value),
            Self::Float(value) => Value::Float(*value),
            Self::Text(value) => Value::Text(value.clone()),
        };
        value.write(writer);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        Ok(match Value::read(reader)? {
            Value::Bool(value) => Self::Bool(value),
            Value::Integer(value) => Self::Integer(value),
            Value::Float(value) => Self::Float(value),
            Value::Text(value) => Self::Text(value),
        })
    }
}
