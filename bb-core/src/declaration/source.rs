//! Sensors, services and actuators as declared.

use crate::message::Frame;
use crate::pubsub::AnyTopic;
use crate::topology::Transform;
use std::sync::Arc;

/// The number of a supervisor: 0 for the robot, then the links, then the joints, in the order of the topology.
pub type Supervisor = usize;

/// A sensor, a controller or a bridge as declared.
#[derive(Clone, Copy, Debug)]
pub struct SensorDeclaration {
    /// Path: `sensor/base_link/imu`.
    pub path: &'static str,
    /// The frame of what it publishes.
    pub frame: Frame,
    /// Nanoseconds between two readings, if it has a `rate`.
    pub period_nanos: Option<i64>,
    /// Takes points from its frame to the root link's, if all joints between are fixed.
    pub root_from_frame: Option<Transform>,
    /// The number of its supervisor.
    pub supervisor: Supervisor,
}

/// An actuator as declared.
#[derive(Clone, Copy, Debug)]
pub struct ActuatorDeclaration {
    /// Path: `actuator/base_link/pan/servo`.
    pub path: &'static str,
    /// The joint that it moves, which is the frame of its commands.
    pub joint: &'static str,
    /// The paths of its reports that a motion begins, and that it ends.
    pub motions: [&'static str; 2],
    /// The number of its supervisor.
    pub supervisor: Supervisor,
    /// Makes the topic of its commands at a path.
    #[doc(hidden)]
    pub new_topic: fn(&'static str) -> Arc<dyn AnyTopic>,
}
