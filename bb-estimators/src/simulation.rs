//! Simulated sensors whose truth is known.

mod imu;
mod motion;

pub use imu::{SimulatedImu, SimulatedImuOptions};
pub use motion::{GRAVITY, Motion};
