//! A running robot in the browser, and for the command `bb`: what is wrong and since when, safety, health, commands, parameters, joints,
//! events and plots, seen and steered over one WebSocket.
//!
//! ```no_run
//! use bb_core::prelude::*;
//! use bb_dashboard::{Dashboard, DashboardOptions};
//! # use bb_core::Options;
//!
//! robot! {
//!     robot Rover;
//!     parameters { speed: f64 = 0.5 m/s, range: 0 m/s..=1.5 m/s; }
//!     link base;
//! }
//!
//! fn main() -> Result<(), Box<dyn std::error::Error>> {
//!     let mut running = Rover::builder().start()?;
//!     let dashboard = Dashboard::serve(&running, DashboardOptions::defaults())?;
//!     println!("{}", dashboard.url());
//!     running.wait();
//!     Ok(())
//! }
//! ```
//!
//! Or as a line of the robot, which prints the address when it starts:
//! `bridges { bridge dashboard: Dashboard(port = 8912); }`.
//!
//! Nothing of the robot waits for a viewer. Without one, the robot's threads hand over its events alone, which are rare. With viewers, one
//! thread takes the newest message of each watched path, at most sixteen times a second, and one thread speaks to the browsers.
//!
//! # Who may do what
//!
//! It listens on the loopback device. A page or a program without the token of the printed address may read, and disarm the robot; with
//! [`DashboardOptions::read`]` = "token"`, only disarm it. With the token it has the rights of [`DashboardOptions::rights`]. Their calls
//! have a name, such as `page 3`, in the events and the journal of the robot, and everything obtained through a connection refuses to act once it ends.
//! Requests by another host name or from another site's pages are refused. `book/src/how-to/live.md` has the protocol, and what is refused and why.

mod bridge;
mod connections;
mod gate;
mod guests;
mod hub;
mod meshes;
mod options;
mod page;
mod protocol;
mod server;
mod shared;
mod token;
mod viewer;

pub use options::DashboardOptions;
pub use protocol::VERSION;
pub use server::{Dashboard, DashboardState, ServeError};
