//! Enforces the limits of an actuator's joint on its commands, and counts how often this happens.

use crate::component::ActuatorContext;
use crate::fault::{Fault, caught, lock};
use crate::joints::Joints;
use crate::message::{Exceeded, JointBounds, LimitedQuantity, OutOfBounds, Payload};
use std::fmt;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

const QUANTITIES: usize = LimitedQuantity::ALL.len();

/// The counters of one actuator.
#[derive(Debug, Default)]
pub(super) struct Counts {
    commands: AtomicU64,
    limited: [AtomicU64; QUANTITIES],
    refused: [AtomicU64; QUANTITIES],
    stopped: Mutex<Option<String>>,
}

/// The counts of an actuator since the start.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ActuatorStatistics {
    /// Path of the actuator.
    pub path: &'static str,
    /// Commands carried out.
    pub commands: u64,
    limited: [u64; QUANTITIES],
    refused: [u64; QUANTITIES],
    /// Reason for which the actuator does not run, if it does not.
    pub stopped: Option<String>,
}

impl ActuatorStatistics {
    /// Returns the number of commands that exceeded the joint's limit of that quantity and were clamped to it.
    pub fn limited(&self, quantity: LimitedQuantity) -> u64 {
        self.limited[quantity as usize]
    }

    /// Returns the number of commands that were refused because they would exceed the joint's limit of that quantity.
    pub fn refused(&self, quantity: LimitedQuantity) -> u64 {
        self.refused[quantity as usize]
    }
}

/// Reason for which a command is not carried out.
pub(super) enum NotLimited {
    /// The first such command if `is_first`.
    OutOfBounds { out: OutOfBounds, is_first: bool },
    /// The payload's code has panicked.
    Failed(Fault),
}

impl Counts {
    /// Clamps a command to the limits of its joint. The payload's code may panic. Returns the quantities whose limit was
    /// exceeded for the first time.
    pub(super) fn limit<T: Payload>(
        &self,
        command: &mut T,
        context: &ActuatorContext,
        joints: &Joints,
    ) -> Result<Vec<LimitedQuantity>, NotLimited> {
        if !T::COMMANDS_JOINT {
            return Ok(Vec::new());
        }
        let bounds = bounds(context, joints);
        match caught(|| Ok(command.limit_command(&bounds))) {
            Ok(Ok(exceeded)) => Ok(self.count(exceeded)),
            Ok(Err(out)) => {
                let is_first = self.refused[out.quantity as usize].fetch_add(1, Ordering::Relaxed) == 0;
                Err(NotLimited::OutOfBounds { out, is_first })
            }
            Err(failed) => Err(NotLimited::Failed(failed.fault)),
        }
    }

    fn count(&self, exceeded: Exceeded) -> Vec<LimitedQuantity> {
        let is_first =
            |quantity: &LimitedQuantity| self.limited[*quantity as usize].fetch_add(1, Ordering::Relaxed) == 0;
        exceeded.quantities().filter(is_first).collect()
    }

    pub(super) fn carried_out(&self) {
        self.commands.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn statistics(&self, path: &'static str) -> ActuatorStatistics {
        let load = |all: &[AtomicU64; QUANTITIES]| std::array::from_fn(|index| all[index].load(Ordering::Relaxed));
        let commands = self.commands.load(Ordering::Relaxed);
        let stopped = lock(&self.stopped).clone();
        ActuatorStatistics { path, commands, limited: load(&self.limited), refused: load(&self.refused), stopped }
    }

    /// Notes why it does not run; `None` once it runs.
    pub(super) fn note_stopped(&self, reason: Option<String>) {
        *lock(&self.stopped) = reason;
    }
}

/// The declared limits of the joint and its position.
fn bounds(context: &ActuatorContext, joints: &Joints) -> JointBounds {
    let mut bounds = JointBounds::NONE;
    bounds.joint = context.joint();
    let Some(limit) = context.topology().joint(context.joint()).and_then(|joint| joint.limit) else {
        return bounds;
    };
    let status = joints.status(context.joint()).filter(|status| !status.is_stale);
    bounds.lower = limit.lower.unwrap_or(bounds.lower);
    bounds.upper = limit.upper.unwrap_or(bounds.upper);
    bounds.velocity = limit.velocity.unwrap_or(bounds.velocity);
    bounds.effort = limit.effort.unwrap_or(bounds.effort);
    bounds.position = status.and_then(|status| status.position.first().copied());
    bounds
}

impl fmt::Display for ActuatorStatistics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} commands", self.path, self.commands)?;
        for quantity in LimitedQuantity::ALL.iter().copied() {
            if self.limited(quantity) > 0 {
                write!(f, ", {} clamped to the limit of {quantity}", self.limited(quantity))?;
            }
            if self.refused(quantity) > 0 {
                write!(f, ", {} refused for its {quantity}", self.refused(quantity))?;
            }
        }
        Ok(())
    }
}
