//! A robot as a tree of links and joints.
//!
//! | what | where |
//! |---|---|
//! | links, joints and the transforms between them, as constants; as URDF and as ROS transforms | [`topology`] |
//! | the poses and motions of the links of a moving robot, and the loads on its joints | [`kinematics`] |
//! | the known states of its joints over time, and its frames at any time | [`joints`] |
//!
//! `bb-core` re-exports these modules, so that a robot depends on that crate alone.

// A robot must not stop because a value was not what it was assumed to be.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// The derive `Payload` names the crate of its users by its absolute path, also here; `bb-message` has all that it needs.
extern crate bb_message as bb_core;

pub mod joints;
pub mod kinematics;
pub mod topology;

/// Items for the runtime. Not for users: they change without notice.
#[doc(hidden)]
pub mod __private {
    pub use crate::joints::route::{InputRoute, RouteOf, Routes};
}
