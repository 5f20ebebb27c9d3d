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
//! While no client is subscribed to a topic, nothing of it is encoded or even received from the robot. A message for several clients is encoded once,
//! on a thread of the bridge. `/tf` takes all messages of the robot, and encodes those from which transforms follow. Encoding that cannot keep up with
//! a topic is a warning in the log.
//!
//! Nothing of the robot waits for a client. For each one, 1,024 messages of at most 16 MiB may wait; a client that is slower loses the oldest, and is
//! sent their number as a warning, at most once a second. One that is stopped or killed costs no other client a message.
//!
//! # Who may do what
//!
//! It listens on the loopback device alone, without encryption; from another machine, it is reached by `ssh -L`. Every program of this machine may
//! read and disarm. Parameters and commands are there if [`FoxgloveOptions::rights`] has them, and then for every such program: there is no token, as
//! the protocol has none. Clients never publish. What a client has asked for is not done any more once it has left.
//!
//! Foxglove's server itself checks neither `Host` nor `Origin`, so that the page of any site could open it in the browser of someone who runs a robot.
//! A door in front of it therefore refuses requests by another name than those of the loopback device, and those of pages that
//! [`FoxgloveOptions::origins`] does not have; programs send no `Origin`. Behind the door, the server is at a random one of the 16 million addresses
//! of the loopback device, and at a random port. Systems that have 127.0.0.1 alone, such as macOS, leave the port, which a page can find by trying:
//! there, give no rights while you browse.
//!
//! A client has a name, such as `foxglove 3`, in the events of commands and in the journal. A command that runs goes on when its client has left. A
//! client that is frozen, or whose cable is cut, has left after 3 s: it is pinged each second, which a browser answers by itself.
//!
//! There are at most 16 clients, and 256 connections that have not said yet what they want. An HTTP head has at most 16 KiB and 5 s, and a message at
//! most 64 KiB. A client may have 24 calls and 32 requests for parameters at once. Requests to disarm have a queue of their own.

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
