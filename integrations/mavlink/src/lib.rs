//! A flight controller on the other side of a MAVLink connection, over UDP or a serial port.
//!
//! | to declare | what | message |
//! |---|---|---|
//! | [`MavlinkImu`] | [`Imu`](bb_core::payload::Imu) | `HIGHRES_IMU`, `SCALED_IMU2` |
//! | [`MavlinkAttitude`] | [`Orientation`](bb_core::payload::Orientation) | `ATTITUDE_QUATERNION` |
//! | [`MavlinkGnss`] | [`GnssFix`](bb_core::payload::GnssFix) | `GPS_RAW_INT` |
//! | [`MavlinkGpsHealth`] | [`GpsReport`](bb_estimators::navigation::state_estimator::GpsReport) for the state estimator | `GPS_RAW_INT`, `STATUSTEXT` |
//! | [`MavlinkHeartbeat`] | [`FlightController`], with the counts of the link | `HEARTBEAT` |
//! | [`MavlinkSender`], a bridge | sends estimates and texts | `GPS_INPUT` or `ODOMETRY`, `STATUSTEXT`, `HEARTBEAT` |
//!
//! ```no_run
//! use bb_core::prelude::*;
//! use bb_mavlink::MavlinkImu;
//!
//! robot! {
//!     robot Drone;
//!     link base { sensor imu: MavlinkImu(link = "udpin:0.0.0.0:14540".into()); }
//! }
//!
//! fn main() -> Result<(), StartError> {
//!     Drone::builder().start()?.wait();
//!     Ok(())
//! }
//! ```
//!
//! All components that name the same [`Address`] share one connection, which one thread reads. It sends a heartbeat
//! once a second: that of each [`MavlinkSender`], or of the onboard computer (1, 191) if there is none, so that a
//! peer that waits for a first message answers.
//!
//! Declare the drivers without a `rate`: they wait for their messages.
//!
//! # Axes
//!
//! MAVLink has north, east, down, and forward, right, down; the framework has east, north, up, and forward, left, up.
//! All published messages are in the framework's axes, and `world_from_body` rotates forward, left, up to east,
//! north, up.
//!
//! # What goes wrong
//!
//! A driver returns an error, which the robot publishes at `fault` before it restarts the driver, if
//!
//! - no message, or none with a value, has come for `timeout`; the error says since when, and whether heartbeats still come,
//! - the flight controller's clock goes back or jumps ahead by more than a second, does not advance for `timeout`, or its stamps stay
//!   more than a second behind for two seconds,
//! - the link fails, because the serial device was unplugged, for example.
//!
//! A flood fills the 64 places of a driver's queue; then the oldest message is dropped, and a warning is logged at
//! most every 10 s. Dropped messages, noise and damaged frames, frames of other dialects, and gaps in the sequence
//! numbers are counted in [`LinkStatistics`], which [`MavlinkHeartbeat`] publishes.
//!
//! # Limits
//!
//! Frames are not signed, and signatures are not checked. Clocks are not synchronised by `TIMESYNC`: `ODOMETRY` and
//! `GPS_INPUT` carry the date of this machine. The dialect `ardupilotmega` has no report of spoofing; see
//! [`MavlinkGpsHealth`].

// A robot must not stop because of an unexpected value.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod address;
mod axes;
mod frames;
mod link;
mod sender;
mod sensor;
mod stamps;
mod transport;

pub use address::{Address, AddressError};
pub use link::{LinkError, LinkStatistics};
pub use sender::{MavlinkSender, MavlinkSenderOptions, MavlinkSent};
pub use sensor::{
    FlightController, MavlinkAttitude, MavlinkAttitudeOptions, MavlinkGnss, MavlinkGnssOptions, MavlinkGpsHealth,
    MavlinkGpsHealthOptions, MavlinkHeartbeat, MavlinkHeartbeatOptions, MavlinkImu, MavlinkImuOptions,
};
