//! Imports of the tests of this binary: the kit of components and its robot, gates, and what records and replays.

pub(crate) use crate::components::*;
pub(crate) use crate::gate::*;
pub(crate) use crate::plain::*;
pub(crate) use crate::replay::{
    Published, Random, collect, entries, is_again, journal, once_more, overflow, play, read_back, run_again, same,
    same_again, same_from_file,
};
pub(crate) use bb_core::event::{CommandPhase, ParameterValue, RefusalReason};
pub(crate) use bb_core::journal::{Entry, Event};
pub(crate) use bb_core::prelude::*;
pub(crate) use bb_core::run::{ActuatorError, ActuatorHandle, Bus, CommandError, DropReason};
pub(crate) use bb_core::telemetry::TelemetryEvent;
pub(crate) use bb_core::{
    ArmError, Builder, DisarmError, DynamicMessage, DynamicSubscription, EstimatorHandle, HealthTransition, Live,
    Report, RequestCodec, Running, SensorHandle,
};
pub(crate) use serde_json::Value;
pub(crate) use std::collections::BTreeMap;
pub(crate) use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, AtomicU64, AtomicUsize, Ordering};
pub(crate) use std::sync::{Arc, Mutex, MutexGuard, OnceLock, mpsc};
