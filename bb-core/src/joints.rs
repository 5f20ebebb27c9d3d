//! What is known of the joints of a robot that runs, and of its frames at any time.
//!
//! Every message with the position of a joint that a declared sensor, estimator, controller or bridge publishes
//! ([`JointState`](crate::payload::JointState), [`JointStates`](crate::payload::JointStates),
//! [`MotorState`](crate::payload::MotorState), and what implements [`JointPositions`](crate::JointPositions)) is kept here,
//! before its subscribers and estimators get it: a bounded history of each joint, by the stamps of the messages.
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
//! A joint is never taken to be at zero because nothing is known of it. One that mimics another follows from that one. A state
//! that is measured at the motor of a joint with a `transmission` is converted to the joint's: position / reduction + offset,
//! velocity / reduction, effort · reduction, the first negative where it is `reversed`.
//!
//! A continuous joint may be told in one turn, or counted on: it is unwound to the nearest turn that the last state and its
//! velocity lead to.
//!
//! # What is refused
//!
//! A state that is not newer than the last of its joint, holds a NaN or an infinity, is more than a second ahead of the clock,
//! has another number of coordinates than the joint, or names an unknown joint. Each is counted, by joint and reason,
//! in [`Report::joints`](crate::Report); the first of each is logged.
//!
//! # Replays
//!
//! Threads that publish joint states and threads that ask for transforms race. What an estimator was answered is therefore
//! a part of the journal, and its replay is given the same transforms, bit by bit, and the same errors. The alternative, to
//! deliver each joint state to each estimator's island, would make every message of an encoder an entry of every such island;
//! a transform is asked for only at a dispatch. Estimators reach transforms only there, so that no other way has to be
//! recorded.

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
