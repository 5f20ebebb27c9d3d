//! What real and simulated runs share: the wiring, and what can be asked of it.

use super::handle::Publisher;
use super::{ComponentFault, Report, Robot, SensorHandle, Startup};
use crate::component::Sensor;
use crate::message::Stamp;
use crate::pubsub::{Overflow, Subscription};
use crate::time::MonotonicTime;
use std::sync::Arc;
use std::time::Instant;

pub(super) struct Machine<R: Robot> {
    pub(super) wiring: Arc<R::Wiring>,
    pub(super) startup: Startup,
}

impl<R: Robot> Machine<R> {
    pub(super) fn subscribe<P: Publisher<R>>(&self, publisher: P, overflow: Overflow) -> Subscription<P::Payload> {
        publisher.topic(R::wired_topics(&self.wiring)).subscribe(overflow)
    }

    pub(super) fn publish<S: Sensor>(&self, sensor: SensorHandle<R, S>, time: MonotonicTime, payload: S::Output) {
        let wall_time = self.startup.clock.wall_at(time);
        let origin = self.startup.origin;
        let stamp = Stamp { monotonic_time: time, wall_time, origin, ..Stamp::default() };
        sensor.publish(&self.wiring, stamp, payload);
    }

    pub(super) fn report(&self) -> Report {
        let topics = R::all_topics(R::wired_topics(&self.wiring));
        let estimators: Vec<_> = R::all_nodes(&self.wiring).iter().map(|node| node.statistics()).collect();
        let stopped = estimators.iter().filter_map(|estimator| {
            let message = estimator.stopped.clone()?;
            Some(ComponentFault { path: estimator.path, message })
        });
        let mut faults = self.startup.faults.all();
        faults.extend(stopped);
        Report { topics: topics.iter().map(|topic| topic.statistics()).collect(), estimators, faults }
    }

    /// Tells the subscribers that no more will come and stops the estimators. One that is still busy at `deadline` is
    /// left behind and reported as a fault.
    pub(super) fn terminate(&self, deadline: Instant) {
        for topic in R::all_topics(R::wired_topics(&self.wiring)) {
            topic.close();
        }
        for node in R::all_nodes(&self.wiring) {
            if !node.terminate(deadline) {
                self.startup.faults.add(node.path(), "did not come back from its input in time".into());
            }
        }
    }
}
