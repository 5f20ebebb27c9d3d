//! What has changed, as it is published: in the order in which it happened, whichever thread it happened on.

use super::{Control, State};
use crate::control::event::{CommandEvent, CommandPhase, ParameterChange, SafetyTransition, StateTransition};
use crate::control::parameters::ParameterValue;
use crate::control::state::Machine;
use crate::control::tasks::lock;
use crate::message::{Payload, Stamp};
use crate::node::HealthTransition;
use crate::pubsub::Topic;
use crate::time::MonotonicTime;

/// What is to be published.
pub(super) enum Change {
    /// From, to, and the command behind it.
    Machine(Machine, Machine, Option<&'static str>),
    /// The number of the command, that of its execution, and the change of health that started it.
    Command(usize, u64, CommandPhase, Option<HealthTransition>),
    /// The number of the parameter, from, to.
    Parameter(usize, ParameterValue, ParameterValue),
}

impl State {
    /// Has a change published at the next [`Control::tell`]: the lock gives it its place.
    pub(super) fn note(&mut self, now: MonotonicTime, change: Change) {
        self.changes.push_back((now, change));
    }
}

impl Control {
    /// Publishes what has changed, without a lock. If somebody does already, on another thread or further up on this one,
    /// he publishes this too.
    pub(super) fn tell(&self) {
        let mut is_mine = false;
        loop {
            let mut state = lock(&self.0.state);
            if state.is_told && !is_mine {
                return;
            }
            let change = state.changes.pop_front();
            is_mine = change.is_some();
            state.is_told = is_mine;
            drop(state);
            match change {
                Some((now, change)) => self.publish_change(now, change),
                None => return,
            }
        }
    }

    fn publish_change(&self, now: MonotonicTime, change: Change) {
        match change {
            Change::Machine(before, after, command) => {
                if before.safety != after.safety {
                    let (from, to) = (before.safety, after.safety);
                    tracing::info!(%from, %to, "safety changed");
                    self.publish(&self.0.topics.safety, SafetyTransition { from, to }, now);
                }
                if before.state() != after.state() {
                    let (from, to) = (before.state(), after.state());
                    tracing::info!(from, to, command, "state changed");
                    self.publish(&self.0.topics.state, StateTransition { from, to, command }, now);
                }
            }
            Change::Command(number, execution, phase, health) => {
                if let (Some(topic), Some(declared)) =
                    (self.0.topics.commands.get(number), self.0.declared.commands.get(number))
                {
                    tracing::debug!(command = declared.name, execution, ?phase, "command");
                    self.publish(topic, CommandEvent { command: declared.name, execution, phase, health }, now);
                }
            }
            Change::Parameter(number, from, to) => {
                if let (Some(topic), Some(declared)) =
                    (self.0.topics.parameters.get(number), self.0.declared.parameters.get(number))
                {
                    self.publish(topic, ParameterChange { path: declared.path, from, to }, now);
                }
            }
        }
    }

    pub(super) fn publish<T: Payload>(&self, topic: &Topic<T>, payload: T, monotonic_time: MonotonicTime) {
        let wall_time = self.0.clock.wall_at(monotonic_time);
        let stamp = Stamp { monotonic_time, wall_time, origin: self.0.origin, ..Stamp::default() };
        topic.publish(&stamp.message(payload));
    }
}
