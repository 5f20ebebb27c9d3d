//! The clock and the alarms of a run, for subscriptions with a highest rate.

use super::Control;
use crate::pubsub::Alarms;
use crate::schedule::{Lane, Sleeper};
use crate::time::{Clock, MonotonicTime};
use std::task::Waker;

/// The clock and the alarms. They do not keep the control state alive, whose topics have them.
struct RunAlarms {
    clock: Clock,
    sleeper: Sleeper,
}

impl Alarms for RunAlarms {
    fn now(&self) -> MonotonicTime {
        self.clock.now()
    }

    fn wake_at(&self, time: MonotonicTime, waker: Waker) {
        self.sleeper.wake_at(time, None, waker);
    }
}

impl Control {
    /// Subscribers are woken as other code of users is.
    pub(crate) fn alarms(&self) -> impl Alarms + 'static {
        RunAlarms { clock: self.0.clock.clone(), sleeper: self.0.sleeper.in_lane(Lane::User) }
    }
}
