//! A robot as a tree of links and joints.
//!
//! | what | where |
//! |---|---|
//! | links, joints and the transforms between them, as constants; as URDF and as ROS transforms | [`topology`] |
//! | the poses and motions of the links of a moving robot, and the loads on its joints | [`kinematics`] |
//!
//! `bb-core` re-exports these modules, so that a robot depends on that crate alone.

// A robot must not stop because a value was not what it was assumed to be.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod kinematics;
pub mod topology;
