//! Simulated components with known truth: sensors on a body that moves by [`Motion`], and joints, their actuators and
//! their sensors in a [`SimulatedWorld`].

mod actuator;
mod encoder;
mod imu;
mod link_imu;
mod motion;
mod plant;
mod random;
mod world;

pub use actuator::{SimulatedActuator, SimulatedActuatorOptions};
pub use encoder::{SimulatedEncoder, SimulatedEncoderOptions};
pub use imu::{SimulatedImu, SimulatedImuOptions};
pub use link_imu::{SimulatedLinkImu, SimulatedLinkImuOptions};
pub use motion::{GRAVITY, Motion};
pub use world::{SimulatedJoint, SimulatedWorld};
