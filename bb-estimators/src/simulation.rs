//! Simulated components with known truth: sensors on a body that moves by [`Motion`], and joints, their actuators and
//! their sensors in a [`SimulatedWorld`].

mod actuator;
mod coupling;
mod encoder;
mod fault;
mod gnss;
mod imu;
mod link_imu;
mod motion;
mod plant;
mod probe;
mod random;
mod root;
mod wheels;
mod world;

pub use actuator::{SimulatedActuator, SimulatedActuatorOptions};
pub use encoder::{SimulatedEncoder, SimulatedEncoderOptions};
pub use fault::GnssFault;
pub use gnss::{SimulatedGnss, SimulatedGnssOptions};
pub use imu::{SimulatedImu, SimulatedImuOptions};
pub use link_imu::{SimulatedLinkImu, SimulatedLinkImuOptions};
pub use motion::{GRAVITY, Motion};
pub use wheels::{SimulatedWheels, SimulatedWheelsOptions};
pub use world::{SimulatedJoint, SimulatedWorld};
