//! The states of a running robot's joints, and its frames at any time.
//!
//! Every message with a joint's position that a declared sensor, estimator, controller or bridge publishes is kept here, before its
//! subscribers and estimators receive it. Such messages are [`JointState`](crate::payload::JointState),
//! [`JointStates`](crate::payload::JointStates), [`MotorState`](crate::payload::MotorState) and any other implementation of
//! [`JointPositions`](crate::JointPositions). Each joint has a bounded history, ordered by the stamps of the messages.
//!
//! # A joint's state at a time
//!
//! | requested time | answer |
//! |---|---|
//! | between two states | interpolated: linearly; an angle without limits, along the shorter arc; a floating joint's rotation, by slerp |
//! | after the newest state, within a tolerance | predicted from the measured velocity; held if no velocity is measured |
//! | after that tolerance | an error: how far in the future |
//! | before the oldest state kept | an error: how far before the history |
//! | any, before the first state has arrived | an error: unknown |
//!
//! A joint whose state is unknown is never assumed to be at zero. A joint that mimics another follows from that one. A state measured
//! at the motor of a joint with a `transmission` is converted to the joint's: position / reduction + offset, velocity / reduction,
//! effort · reduction. The reduction counts as negative where the transmission is `reversed`.
//!
//! The angle of a continuous joint may be reported within one turn or accumulated over turns. It is unwound to the turn nearest to
//! the prediction from the last state and its velocity.
//!
//! # Refused states
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
mod viewers;

pub use error::{Gap, LookupError};
pub use frames::TransformHandle;
pub(crate) use route::{InputRoute, RouteOf};
pub use route::{Latest, PlacedInput, Placement};
pub use status::{JointRefusal, JointStatistics, JointStatus};
pub use store::{JointSettings, Joints};
pub use viewers::{ViewerChannel, ViewerMessage, ViewerMessages};

#[cfg(test)]
mod tests;
