//! The states of a running robot's joints, and its frames at any time.
//!
//! Every message with a joint's position that a declared sensor, estimator, controller or bridge publishes is kept here, before its
//! subscribers and estimators receive it. Such messages are [`JointState`](crate::payload::JointState),
//! [`JointStates`](crate::payload::JointStates), [`MotorState`](crate::payload::MotorState) and any other implementation of
//! [`JointPositions`](crate::JointPositions). Each joint has a bounded history, ordered by the stamps of the messages.
//!
//! # A joint's state at a time
//!
//! | asked for | answer |
//! |---|---|
//! | between two states | interpolated: linearly, an angle without limits the short way, a floating joint's rotation along the great circle |
//! | after the newest, by no more than a tolerance | predicted with the measured velocity; held where none is measured |
//! | later than that | an error: how far in the future |
//! | before the oldest that is kept | an error: how far out of the history |
//! | no state has come | an error: unknown |
//!
//! A joint is never assumed to be at zero because its state is unknown. A joint that mimics another follows from that one. A state
//! measured at the motor of a joint with a `transmission` is converted to the joint's: position / reduction + offset, velocity /
//! reduction, effort · reduction, the first negative where it is `reversed`.
//!
//! The angle of a continuous joint may be reported within one turn or accumulated over turns. It is unwound to the turn nearest to
//! the prediction from the last state and its velocity.
//!
//! # What is refused
//!
//! A state is refused if it is not newer than the last state of its joint, holds a NaN or an infinity, or is more than a second
//! ahead of the clock. It is also refused if its number of coordinates differs from the joint's or if it names an unknown joint.
//! Refused states are counted by joint and reason in [`Report::joints`](crate::Report); the first of each is logged.
//!
//! # Replays
//!
//! Threads that publish joint states race with threads that ask for transforms. The answers given to an estimator are therefore
//! part of the journal, and a replay gives it the same transforms, bit by bit, and the same errors. The alternative is to deliver
//! each joint state to each estimator's island, which would make every encoder message an entry of every such island. A transform
//! is asked for only at a dispatch. Estimators reach transforms only there, so no other access needs to be recorded.

mod error;
mod frames;
mod history;
mod reading;
mod route;
mod snapshot;
mod states;
mod status;
mod store;

pub use error::{Gap, LookupError};
pub use frames::TransformHandle;
pub(crate) use route::{InputRoute, RouteOf};
pub use route::{Latest, PlacedInput, Placement};
pub use status::{JointRefusal, JointStatistics, JointStatus};
pub use store::{JointSettings, Joints};

#[cfg(test)]
mod tests;
