//! Measurements and reports of the flight controller, as sensors.

mod attitude;
mod gnss;
mod gps_health;
mod heartbeat;
mod imu;
mod stream;

pub use attitude::{MavlinkAttitude, MavlinkAttitudeOptions};
pub use gnss::{MavlinkGnss, MavlinkGnssOptions};
pub use gps_health::{MavlinkGpsHealth, MavlinkGpsHealthOptions};
pub use heartbeat::{FlightController, MavlinkHeartbeat, MavlinkHeartbeatOptions};
pub use imu::{MavlinkImu, MavlinkImuOptions};
