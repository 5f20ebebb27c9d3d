//! Several machines: sensors whose messages come from another robot, and the bridge that sends them.
//!
//! | to declare | what |
//! |---|---|
//! | [`Remote<T>`], a sensor | the messages that another robot publishes at a path |
//! | [`Share`], a bridge | sends what is published at selected paths to every robot that asks for it |
//!
//! ```no_run
//! use bb_core::prelude::*;
//! use bb_zenoh::{Remote, Share, Source};
//!
//! robot! {
//!     robot Mast;
//!     link mast { sensor gnss: External<GnssFix>(); }
//!     bridges { bridge net: Share(paths = "sensor/mast", listen = "tcp/127.0.0.1:7600"); }
//! }
//! robot! {
//!     robot Rover;
//!     link base {
//!         sensor gnss: Remote<GnssFix>(from = Source::of(mast::sensor::mast::gnss), connect = "tcp/127.0.0.1:7600");
//!     }
//! }
//!
//! fn main() -> Result<(), StartError> {
//!     // On one machine; on the other, `Rover`.
//!     Mast::builder().start()?.wait();
//!     Ok(())
//! }
//! ```
//!
//! Each robot has its own clock, journal and safety state, and goes on alone when the cable is cut. Nothing but messages, and questions
//! for the time, crosses: a robot cannot arm, disarm or command another.
//!
//! # On the wire
//!
//! A message is the exact layout of [`Stamped`](bb_core::Stamped), put at `bb/ROBOT/PATH/HASH`, where the hash is that of the layout. Its
//! attachment has, as little-endian 64-bit numbers, the session of the sender (random, of one run), the number of the message, the time of
//! the measurement and the time at which it was put, both in nanoseconds on the sender's monotonic clock. `bb/ROBOT/@clock` answers with
//! the session and two such times: those at which the question came and at which it was answered.

mod clock;
mod inbox;
mod peer;
mod sensor;
mod share;
mod source;
mod tally;
mod wire;

pub use sensor::{Remote, RemoteOptions};
#[doc(hidden)]
pub use share::{OwnClock, ShownClock};
pub use share::{Share, ShareOptions, SharedMessages};
pub use source::Source;

use crate::session::{SessionSettings, list};
use std::path::Path;

/// The session of components with these options.
fn settings(listen: &str, connect: &str, config: &Path) -> SessionSettings {
    let file = Some(config.to_owned()).filter(|path| !path.as_os_str().is_empty());
    SessionSettings { listen: list(listen), connect: list(connect), file, ..SessionSettings::default() }
}
