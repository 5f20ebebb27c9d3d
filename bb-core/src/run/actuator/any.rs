//! A type-erased actuator: the interface used by the runtime.

use super::held::{Guarded, Held};
use super::{ActuatorNode, ActuatorStatistics};
use crate::component::{Accepts, AcceptsJson, Actuator};
use crate::fault::Termination;
use crate::message::codec::Shape;
use crate::message::{Field as _, Payload as _};
use crate::payload::MotionEnd;
use crate::pubsub::{AnyTopic, DynamicMessage};
use crate::time::MonotonicTime;
use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The common interface of all running actuators.
pub trait AnyActuator {
    /// Returns the path of the actuator.
    fn path(&self) -> &'static str;
    /// The name of its command type.
    fn command_name(&self) -> &'static str;
    /// The shape of its commands.
    #[doc(hidden)]
    fn command_shape(&self) -> Shape;
    /// An `Arc<dyn AcceptsJson>`.
    #[doc(hidden)]
    fn accepts_json(&self) -> Box<dyn Any>;
    /// The topic of its commands.
    #[doc(hidden)]
    fn any_topic(&self) -> &dyn AnyTopic;
    /// An `Arc<dyn Accepts<T>>`, where `T` is the type of its commands.
    #[doc(hidden)]
    fn accepts(&self) -> Box<dyn Any>;
    /// Publishes a command that the actuator carried out, in a replay; returns `false` if the command has another type.
    #[doc(hidden)]
    fn replay(&self, message: &DynamicMessage) -> bool;
    /// Stops the actuator once it is free; returns `false` if it is still busy after `timeout`.
    #[doc(hidden)]
    fn terminate(&self, timeout: Duration) -> bool;
    /// The time at which its code was entered, if a thread is inside.
    #[doc(hidden)]
    fn entered_at(&self) -> Option<MonotonicTime>;
    /// The counts of the actuator.
    #[doc(hidden)]
    fn statistics(&self) -> ActuatorStatistics;
}

impl<A: Actuator> AnyActuator for ActuatorNode<A> {
    fn path(&self) -> &'static str {
        self.0.declaration.path
    }

    fn command_name(&self) -> &'static str {
        A::Command::NAME
    }

    fn command_shape(&self) -> Shape {
        A::Command::SHAPE
    }

    fn accepts_json(&self) -> Box<dyn Any> {
        let accepts: Arc<dyn AcceptsJson> = Arc::clone(&self.0) as _;
        Box::new(accepts)
    }

    fn any_topic(&self) -> &dyn AnyTopic {
        &*self.0.topic
    }

    fn accepts(&self) -> Box<dyn Any> {
        let accepts: Arc<dyn Accepts<A::Command>> = Arc::clone(&self.0) as _;
        Box::new(accepts)
    }

    fn replay(&self, message: &DynamicMessage) -> bool {
        message.downcast::<A::Command>().map(|message| self.0.topic.publish(message)).is_some()
    }

    fn terminate(&self, timeout: Duration) -> bool {
        let Some(mut state) = enter_within(&self.0.state, timeout) else { return false };
        let fault = {
            let _entered = self.0.occupied.enter(self.0.environment.clock());
            if state.may_move {
                // Its disarm callback still waits: code of this actuator was late, or has stopped the robot.
                self.0.make_safe(&mut state);
            }
            state.slot.retire(Termination::Stop)
        };
        state.slot.stop();
        self.0.end_motion(MotionEnd::Stopped);
        self.0.leave(state);
        if let Some(fault) = fault {
            self.0.control.note_fault(self.0.declaration.path, fault.to_string());
        }
        true
    }

    fn entered_at(&self) -> Option<MonotonicTime> {
        self.0.occupied.entered_at()
    }

    fn statistics(&self) -> ActuatorStatistics {
        self.0.counts.statistics(self.0.declaration.path)
    }
}

fn enter_within<S>(state: &Guarded<S>, timeout: Duration) -> Option<Held<'_, S>> {
    let start = Instant::now();
    loop {
        match state.try_enter() {
            Some(held) => return Some(held),
            None if start.elapsed() >= timeout => return None,
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}
