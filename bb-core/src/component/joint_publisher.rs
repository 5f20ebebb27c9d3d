//! Publishes the state of all joints.

use super::{Fault, NoOptions, Reading, Service, ServiceContext};
use crate::joints::Joints;
use crate::payload::JointSnapshot;
use crate::time::MonotonicTime;

/// A bridge that publishes all joints as a whole, as `sensor_msgs/JointState`, at its declared rate:
/// `bridge joint_states: JointPublisher() { rate: 50 Hz; }`.
///
/// All joints in a message are at the same time: the latest at which every joint that is known and not stale has a
/// state. Nothing is published until that time advances.
#[derive(Debug)]
pub struct JointPublisher {
    joints: Joints,
    last: Option<MonotonicTime>,
}

impl Service for JointPublisher {
    type Options = NoOptions;
    type Output = JointSnapshot;

    fn init(_: NoOptions, context: &ServiceContext) -> Result<Self, Fault> {
        if context.period_s().is_none() {
            return Err(Fault::permanent("it publishes at a rate; declare one, as in `rate: 50 Hz;`"));
        }
        Ok(Self { joints: context.bus().joints(), last: None })
    }

    fn update(&mut self, _: MonotonicTime) -> Result<Reading<JointSnapshot>, Fault> {
        let Some((time, snapshot)) = self.joints.snapshot() else { return Ok(Reading::nothing()) };
        if self.last.is_some_and(|last| last >= time) {
            return Ok(Reading::nothing());
        }
        self.last = Some(time);
        Ok(Reading::at(time, snapshot))
    }
}
