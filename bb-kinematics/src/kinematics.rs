//! Poses and motions of a robot's links, and loads on its joints.
//!
//! [`Kinematics`] is created once, from a [`Topology`](crate::topology::Topology). Its functions take the state of
//! the joints as plain numbers and allocate nothing.
//!
//! # Coordinates
//!
//! A *position* of the robot is a slice of [`Kinematics::positions`] numbers, a *velocity* one of
//! [`Kinematics::velocities`]. [`Kinematics::joint`] says which of them belong to a joint:
//!
//! | joint | position | velocity |
//! |---|---|---|
//! | fixed | – | – |
//! | revolute, continuous | angle, rad | rad/s |
//! | prismatic | length, m | m/s |
//! | planar | x and y in the plane, m; angle about its normal, rad | along x and y of the child, m/s; rad/s |
//! | floating | x, y, z, m; unit quaternion w, x, y, z | linear, m/s, then angular, rad/s, in the frame of the child |
//!
//! The plane of a planar joint is that of x and y after the shortest rotation that takes z to its axis. A joint that
//! mimics another has no coordinates of its own.
//!
//! # Frames
//!
//! `base_from_tip` transforms points from the frame of the link `tip` to that of `base`. A link's frame is that of
//! the joint which carries it, as in URDF.
//!
//! The equations are those of Featherstone, *Rigid Body Dynamics Algorithms*, 2008, chapters 4 to 6, for vectors at the origin
//! of each frame and in its axes.

mod chain;
mod coordinates;
mod dynamics;
mod error;
mod gravity;
mod inverse;
mod mass;
mod model;
mod tree;

pub use chain::Chain;
pub use dynamics::Dynamics;
pub use error::KinematicsError;
pub use inverse::{InverseKinematics, InverseParams, Solution, Target};
pub use model::{JointCoordinates, Kinematics, LinkId};
pub use tree::{Frames, LinkMotion};
