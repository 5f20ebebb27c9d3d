//! Messages between the components of a robot, and with other programs.
//!
//! | what | where |
//! |---|---|
//! | instants; the clock, real or virtual, and those of devices | [`time`] |
//! | a payload with its time, frame and origin; as bytes, as a ROS message, as JSON | [`message`], [`message::codec`] |
//! | the standard payloads, in SI units | [`payload`] |
//! | what an estimator emits: payloads | [`outputs`] |
//!
//! `bb-core` re-exports these modules, so that a robot depends on that crate alone.

// A robot must not stop because a value was not what it was assumed to be.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// The derives name the crate of their users by its absolute path, also here.
extern crate self as bb_core;

pub mod message;
pub mod outputs;
pub mod payload;
pub mod time;

mod sorted;

#[doc(hidden)]
pub use message::{Field, Finite, Payload};

/// Items for the runtime and the expansions of the macros. Not for users: they change without notice.
#[doc(hidden)]
pub mod __private {
    pub use crate::message::codec::derive::{FieldOf, NotField, is_any, is_finite};
    pub use crate::message::codec::intern::intern;
    pub use crate::message::codec::json::{
        Definitions, compose, document, elements_of, member, member_of, members_of,
    };
    pub use crate::message::codec::{
        DecodeError, EnumShape, FieldShape, FieldUnit, Reader, RosLayout, Shape, StructShape, Writer,
    };
    pub use crate::message::nearest::{did_you_mean, nearest, nearest_path};
    pub use crate::message::{
        Exceeded, JointBounds, JointCommand, JointPositions, JointReading, OutOfBounds, Stamped, Transmission,
    };
    pub use crate::outputs::unknown::{NoField, UNKNOWN_INDEX, Unknown};
    pub use crate::sorted::Sorted;
    pub use crate::time::instant::nanos_of;
    pub use crate::time::stopwatch::Stopwatch;
}
