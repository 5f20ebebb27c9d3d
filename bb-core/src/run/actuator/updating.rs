//! Updates of an actuator at the times that it asks for.

use super::{Inner, State};
use crate::component::Actuator;
use crate::fault::caught;
use crate::time::MonotonicTime;
use std::sync::{Arc, Weak};
use std::task::{Wake, Waker};
use std::time::Duration;

/// The least delay before an actuator that asks to be updated at once, or in the past, is updated.
const LEAST_PERIOD: Duration = Duration::from_micros(10);

impl<A: Actuator> Inner<A> {
    /// Schedules its next update.
    pub(super) fn schedule_update(&self, state: &mut State<A>) {
        let Some(due) = self.next_update(state) else { return };
        // An update must not prevent virtual time from advancing.
        let due = due.max(self.environment.clock().now() + LEAST_PERIOD);
        if state.alarm.is_none_or(|alarm| due < alarm) {
            state.alarm = Some(due);
            self.control.wake_at(due, Waker::from(Arc::new(Due(Weak::clone(&self.this)))));
        }
    }

    /// Returns the time at which the actuator's code asks to be updated.
    pub(super) fn next_update(&self, state: &mut State<A>) -> Option<MonotonicTime> {
        let actuator = state.slot.running()?;
        let asked = {
            let _entered = self.occupied.enter(self.environment.clock());
            caught(|| Ok(actuator.next_update()))
        };
        asked.unwrap_or_else(|failed| {
            self.fail(state, &failed, self.environment.clock().now());
            None
        })
    }

    pub(super) fn update_if_due(&self, state: &mut State<A>, now: MonotonicTime) {
        state.alarm.take_if(|alarm| *alarm <= now);
        if self.next_update(state).is_none_or(|due| due > now) {
            return;
        }
        let Some(actuator) = state.slot.running() else { return };
        let updated = {
            let _entered = self.occupied.enter(self.environment.clock());
            caught(|| actuator.update(now))
        };
        if let Err(failed) = updated {
            self.fail(state, &failed, now);
        }
    }
}

/// Runs when the actuator's backoff is over or an update is due.
pub(super) struct Due<A: Actuator>(pub(super) Weak<Inner<A>>);

impl<A: Actuator> Wake for Due<A> {
    fn wake(self: Arc<Self>) {
        if let Some(inner) = self.0.upgrade() {
            inner.alone(|state| {
                inner.obey(state);
                let now = inner.environment.clock().now();
                inner.restart_if_due(state, now);
                inner.update_if_due(state, now);
            });
        }
    }
}
