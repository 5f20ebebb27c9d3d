//! A running robot in [Foxglove](https://foxglove.dev): its topics as a recording has them, with `/tf`, `/tf_static` and
//! `/robot_description`, and, if that is allowed, its parameters and commands.
//!
//! ```
//! use bb_core::prelude::*;
//! use bb_foxglove::{Foxglove, FoxgloveOptions};
//! # use bb_core::Options;
//!
//! robot! { robot Rover; link base { sensor imu: External<Imu>(); } }
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let rover = Rover::builder().simulate()?;
//!     let foxglove = Foxglove::serve(&rover, FoxgloveOptions { port: 0, ..FoxgloveOptions::defaults() })?;
//!     println!("open ws://{} in Foxglove", foxglove.address());
//!     Ok(())
//! }
//! ```
//!
//! Or as a line of the robot: `bridges { bridge foxglove: Foxglove(port = 8765); }`.
//!
//! A message is encoded while a client is subscribed to its topic, and not otherwise. Nothing of the robot waits for a client: a slow one loses the
//! oldest messages that wait for it, and gets their number as a warning.
//!
//! # Who may do what
//!
//! It listens on the loopback device alone, without encryption; from another machine, it is reached by `ssh -L`. Every program of this machine may
//! read and disarm. Parameters and commands are there if [`FoxgloveOptions::rights`] has them, and then for every such program: there is no token, as
//! the protocol has none. Clients never publish. What a client has asked for is not done any more once it has left.
//!
//! Foxglove's server itself checks neither `Host` nor `Origin`, so that the page of any site could open it in the browser of someone who runs a robot.
//! A door in front of it therefore refuses requests by another name than those of the loopback device, and those of pages that
//! [`FoxgloveOptions::origins`] does not have.

// A robot must not stop because of what a client sends.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod bridge;
mod channels;
mod clients;
mod door;
mod inbound;
mod options;
mod outbox;
mod parameters;
mod server;
mod services;

pub use options::FoxgloveOptions;
pub use server::{Foxglove, FoxgloveState, ServeError};
