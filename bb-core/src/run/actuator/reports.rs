//! Publishes an actuator's reports of its motions, at `begin_motion` and `end_motion` below its path.

use crate::component::{ActuatorContext, MotionReport};
use crate::control::ActuatorTopics;
use crate::journal::{Event, Recorded};
use crate::message::{Frame, Payload, Stamped};
use crate::node::Environment;
use crate::pubsub::{AnyTopic as _, DynamicMessage, Topic, Wakers};

/// Publishes the reports in order. The caller holds the actuator's lock; `wakers` run after it is released.
pub(super) fn publish_reports(
    topics: &ActuatorTopics,
    context: &ActuatorContext,
    environment: &Environment,
    wakers: &mut Wakers,
) {
    let reports = context.take_reports();
    if reports.is_empty() {
        return;
    }
    let Some(_inside) = environment.door().enter() else { return };
    let stamp = environment.stamp(environment.clock().now(), Frame::new(context.joint()));
    for report in reports {
        match report {
            MotionReport::Begin(motion) => {
                publish(&topics.begin_motion, &stamp.message(motion), environment, wakers);
            }
            MotionReport::End(motion) => publish(&topics.end_motion, &stamp.message(motion), environment, wakers),
        }
    }
}

fn publish<T: Payload>(topic: &Topic<T>, message: &Stamped<T>, environment: &Environment, wakers: &mut Wakers) {
    if let Some(journal) = environment.journal() {
        let path = topic.path();
        let recorded = Recorded::Message(DynamicMessage::new(path, message));
        let offset = environment.clock().wall_offset_nanos();
        journal.write(message.monotonic_time, offset, Event::Own { path, message: recorded });
    }
    topic.publish_deferred(message, wakers);
}
