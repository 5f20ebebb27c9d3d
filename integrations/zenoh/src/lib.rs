//! A robot as a node of ROS 2, over [zenoh](https://zenoh.io): what `rmw_zenoh_cpp` has on the wire, without ROS.

// A robot must not stop because of what another program sends.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bridge;
mod clients;
mod diagnostics;
mod inputs;
mod messages;
mod node;
mod options;
mod outputs;
mod parameters;
mod services;
mod session;

pub use bridge::{Ros2Bridge, Ros2Error, Ros2State};
pub use options::Ros2Options;
pub use session::{Mode, Session, SessionError, SessionSettings};
