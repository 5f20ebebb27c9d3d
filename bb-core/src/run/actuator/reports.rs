//! Publishes an actuator's reports of its motions at `begin_motion` and `end_motion` below its path.

use crate::component::{ActuatorContext, Host, MotionReport};
use crate::journal::{Event, Recorded};
use crate::message::{Frame, Payload, Stamp, Stamped};
use crate::node::Environment;
use crate::payload::{BeginMotion, EndMotion};
use crate::pubsub::{AnyTopic as _, DynamicMessage, Topic, Wakers};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The topics are created with the first report. For an actuator of standard commands they are created at the start, so that
/// subscriptions find them.
#[derive(Debug, Default)]
pub(super) struct Reports {
    begin: OnceLock<Option<Arc<Topic<BeginMotion>>>>,
    end: OnceLock<Option<Arc<Topic<EndMotion>>>>,
    /// Why there is no topic, to be logged once the actuator's lock is released.
    refusals: Mutex<Vec<String>>,
}

impl Reports {
    /// Creates the topics.
    pub(super) fn announce(&self, context: &ActuatorContext, host: &dyn Host) {
        let _ = (self.begin(context, host), self.end(context, host));
    }

    /// Creates the topic at `path`, if it is one of them.
    pub(super) fn announce_at(&self, path: &str, context: &ActuatorContext, host: &dyn Host) {
        match path.strip_prefix(context.path()) {
            Some("/begin_motion") => drop(self.begin(context, host)),
            Some("/end_motion") => drop(self.end(context, host)),
            _ => {}
        }
    }

    /// Publishes the actuator's reports in order. The caller holds the actuator's lock; `wakers` run after it is released.
    pub(super) fn publish(
        &self,
        context: &ActuatorContext,
        host: &dyn Host,
        environment: &Environment,
        wakers: &mut Wakers,
    ) {
        let reports = context.take_reports();
        if reports.is_empty() {
            return;
        }
        let Some(_inside) = environment.door().enter() else { return };
        let clock = environment.clock();
        let now = clock.now();
        let stamp = Stamp {
            monotonic_time: now,
            wall_time: clock.wall_at(now),
            frame: Frame::new(context.joint()),
            origin: environment.origin(),
        };
        for report in reports {
            match report {
                MotionReport::Begin(motion) => {
                    publish(self.begin(context, host), &stamp.message(motion), environment, wakers);
                }
                MotionReport::End(motion) => {
                    publish(self.end(context, host), &stamp.message(motion), environment, wakers);
                }
            }
        }
    }

    /// Returns why topics could not be created, once for each.
    pub(super) fn take_refusals(&self) -> Vec<String> {
        std::mem::take(&mut *self.refusals.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn begin(&self, context: &ActuatorContext, host: &dyn Host) -> Option<&Topic<BeginMotion>> {
        self.begin.get_or_init(|| self.topic(context, host, "begin_motion")).as_deref()
    }

    fn end(&self, context: &ActuatorContext, host: &dyn Host) -> Option<&Topic<EndMotion>> {
        self.end.get_or_init(|| self.topic(context, host, "end_motion")).as_deref()
    }

    fn topic<T: Payload>(&self, context: &ActuatorContext, host: &dyn Host, name: &str) -> Option<Arc<Topic<T>>> {
        let path = format!("{}/{name}", context.path());
        match host.registry().topic_noted(&path, &mut |change| host.note_path(change)) {
            Ok(topic) => Some(topic),
            Err(error) => {
                self.refusals.lock().unwrap_or_else(PoisonError::into_inner).push(error.to_string());
                None
            }
        }
    }
}

fn publish<T: Payload>(
    topic: Option<&Topic<T>>,
    message: &Stamped<T>,
    environment: &Environment,
    wakers: &mut Wakers,
) {
    let Some(topic) = topic else { return };
    if let Some(journal) = environment.journal() {
        let path = topic.path();
        let recorded = Recorded::Message(DynamicMessage::new(path, message));
        let offset = environment.clock().wall_offset_nanos();
        journal.write(message.monotonic_time, offset, Event::Own { path, message: recorded });
    }
    topic.publish_deferred(message, wakers);
}
