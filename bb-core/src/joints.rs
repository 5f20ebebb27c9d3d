//! The states of a running robot's joints, and its frames at any time.
//!
//! Every message with a joint's position that a declared sensor, estimator, controller or bridge publishes is kept here, before its
//! subscribers and estimators receive it. Such messages are [`JointState`](crate::payload::JointState),
//! [`JointStates`](crate::payload::JointStates), [`MotorState`](crate::payload::MotorState) and any other implementation of
//! [`JointPositions`](crate::JointPositions). Each joint has a bounded history, ordered by the stamps of the messages. What a joint's
//! state at a time is, and which states are refused, is documented at [`Joints`]. Refused states are counted in
//! [`Report::joints`](crate::Report).
//!
//! # Replays
//!
//! Threads that publish joint states race with threads that ask for transforms. The answers given to an estimator are therefore
//! part of the journal, and a replay gives it the same transforms, bit by bit, and the same errors. The alternative is to deliver
//! each joint state to each estimator's island, which would make every encoder message an entry of every such island. A transform
//! is asked for only at a dispatch. Estimators reach transforms only there, so no other access needs to be recorded.

mod viewers;

use crate::pubsub::Select;
#[doc(inline)]
pub use bb_kinematics::joints::{
    Gap, JointRefusal, JointSettings, JointStatistics, JointStatus, Joints, Latest, LookupError, PlacedInput,
    Placement, TransformHandle,
};
pub use viewers::{ViewerChannel, ViewerMessage, ViewerMessages};

/// The paths made at run time at which messages tell of joints.
pub(crate) const TELLING_PATHS: Select<'static> = Select::Below("sensor");
