//! A robot as a node of ROS 2, over [zenoh](https://zenoh.io): what `rmw_zenoh_cpp` has on the wire, without ROS. And sensors whose messages come
//! from a robot on another machine: [`remote`].

// A robot must not stop because of what another program sends.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bridge;
mod clients;
mod counts;
mod diagnostics;
mod error;
mod inputs;
mod interfaces;
mod messages;
mod node;
mod options;
mod outputs;
mod parameters;
pub mod remote;
mod services;
mod session;

pub use bridge::Ros2Bridge;
pub use counts::Ros2State;
pub use error::Ros2Error;
pub use interfaces::write_interfaces;
pub use options::Ros2Options;
#[doc(hidden)]
pub use remote::{OwnClock, ShownClock};
pub use remote::{Remote, RemoteOptions, Share, ShareOptions, SharedMessages, Source};
pub use session::{Mode, Session, SessionError, SessionSettings};
