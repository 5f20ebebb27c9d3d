//! Publishing recorded messages of others than estimators.

use super::Replayer;
use crate::fault::{discard, guarded, log_panic};
use crate::joints::TELLING_PATHS;
use crate::journal::{Recorded, decoded};
use crate::node::Replayed;
use crate::pubsub::{AnyTopic, DynamicMessage};
use crate::time::MonotonicTime;
use std::sync::Arc;

impl Replayer {
    /// Publishes an estimator's output in reply to a request that the journal does not hold.
    pub(super) fn emit(
        &self,
        publisher: usize,
        is_first: bool,
        time: MonotonicTime,
        message: Recorded,
    ) -> Result<(), String> {
        let message = self.message(publisher, message)?;
        let (number, island) = self.emitter(publisher).ok_or("the robot has no such publisher")?;
        if is_first {
            self.machine.environment.node(number).counters().emitted.increment();
        }
        let played = self.island(island, time, Replayed::Emission(&message));
        discard(message);
        played?;
        // It matches the journal.
        let _ = self.machine.environment.replayed().take(island);
        Ok(())
    }

    pub(super) fn actuated(&self, number: usize, message: Recorded) -> Result<(), String> {
        let actuators = self.machine.actuators();
        let actuator = actuators.get(number).ok_or("the robot has no such actuator")?;
        let message = decoded(actuator.any_topic(), message).map_err(|error| error.to_string())?;
        let mut is_known = true;
        handed_out(|| is_known = actuator.replay(&message));
        discard(message);
        if is_known { Ok(()) } else { Err("the actuator takes other commands".to_owned()) }
    }

    pub(super) fn publish_own(
        &self,
        path: &'static str,
        time: MonotonicTime,
        message: Recorded,
    ) -> Result<(), String> {
        // An actuator reports its motions at topics of its own.
        let declared = self.machine.control.topics().all().into_iter().find(|topic| topic.path() == path);
        match declared {
            Some(topic) => publish(topic, message, |_| ()),
            None => publish(&*self.own_topic(path, &message)?, message, |message| {
                if TELLING_PATHS.includes(path) {
                    let joints = self.machine.environment.joints();
                    joints.hear_at(path, message.stamp(), time, |listener| message.tell_joints(listener));
                }
            }),
        }
    }

    fn own_topic(&self, path: &str, message: &Recorded) -> Result<Arc<dyn AnyTopic>, String> {
        let registry = &self.machine.control.topics().registry;
        match (registry.topics().into_iter().find(|topic| topic.path() == path), message) {
            (Some(topic), _) => Ok(topic),
            (None, Recorded::Message(message)) => {
                registry.topic_of(message, &mut |_, _| ()).map_err(|error| error.to_string())
            }
            (None, Recorded::Bytes(_)) => Err(format!(
                "something was published at `{path}`, a path made at run time, and the payload is not known: make a \
                 publisher there first, `replay.bus().publisher::<T>(\"{path}\")`"
            )),
        }
    }

    pub(super) fn message(&self, publisher: usize, message: Recorded) -> Result<DynamicMessage, String> {
        let topics = self.machine.wired.topics();
        let topic = topics.get(publisher).ok_or("the robot has no such publisher")?;
        decoded(*topic, message).map_err(|error| error.to_string())
    }
}

/// Publishes a message after `before`.
fn publish(topic: &dyn AnyTopic, message: Recorded, before: impl FnOnce(&DynamicMessage)) -> Result<(), String> {
    let message = decoded(topic, message).map_err(|error| error.to_string())?;
    let mut is_known = true;
    handed_out(|| {
        before(&message);
        is_known = topic.publish_dynamic(&message);
    });
    discard(message);
    if is_known { Ok(()) } else { Err(format!("`{}` has another payload", topic.path())) }
}

/// Hands a recorded message to the current subscribers. If its code panics for one of them, the message and its
/// consequences are still the same.
pub(super) fn handed_out(hand_out: impl FnOnce()) {
    if let Err(fault) = guarded(hand_out) {
        log_panic("a recorded message failed where it was copied", &fault);
    }
}
