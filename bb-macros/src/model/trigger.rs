//! The trigger of a publisher, traced back through estimators, and its period.

use super::{From, Home, PublisherId, Robot, SensorId, ServiceId};

/// The start of a chain of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trigger {
    Sensor(SensorId),
    Service(ServiceId),
}

impl Robot {
    /// The publisher whose message triggers this one. `None` in a cycle, and if an input names nothing.
    pub(crate) fn trigger(&self, mut publisher: PublisherId) -> Option<Trigger> {
        for _ in 0..=self.estimators.len() {
            let id = match self.publishers[publisher].from {
                From::Sensor(id) => return Some(Trigger::Sensor(id)),
                From::Service(id) => return Some(Trigger::Service(id)),
                From::Estimator(id, _) => id,
            };
            let estimator = &self.estimators[id];
            match estimator.home {
                Home::Sensor(sensor) => return Some(Trigger::Sensor(sensor)),
                Home::Link(_) => publisher = estimator.driver()?.source?,
            }
        }
        None
    }

    /// The time between two messages of a publisher, in s, if the rate of its sensor is declared.
    pub(crate) fn period_s(&self, publisher: PublisherId) -> Option<f64> {
        match self.trigger(publisher)? {
            Trigger::Sensor(id) => self.sensors[id].period_s,
            Trigger::Service(id) => self.services[id].period_s,
        }
    }
}
