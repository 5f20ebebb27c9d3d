//! Commands that do not return, and commands that keep virtual time from advancing.

use super::step::Step;
use super::task::MOST_AT_ONCE;
use super::{Control, Phase};
use crate::declaration::Role;
use crate::event::RefusalReason;
use crate::node::Mode;
use crate::schedule::Lane;
use crate::time::MonotonicTime;
use std::sync::PoisonError;
use std::time::Duration;

/// Executions whose code has not returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Hanging {
    /// The path of the command.
    pub(crate) path: &'static str,
    /// The number of the first of these executions.
    pub(crate) first: u64,
    /// How long its code has been running.
    pub(crate) duration: Duration,
}

impl Control {
    /// For each command, the first execution whose code has been running for `longest` or longer.
    pub(crate) fn hanging(&self, now: MonotonicTime, longest: Duration) -> Vec<Hanging> {
        let state = self.lock();
        let mut hanging: Vec<Hanging> = Vec::new();
        for execution in &state.executions {
            let Some(entered) = execution.task.as_ref().and_then(|task| task.entered_at()) else { continue };
            let Some(declared) = self.0.declared.commands.get(execution.command) else { continue };
            let duration = now.duration_since(entered);
            if duration >= longest && hanging.iter().all(|other| other.path != declared.path) {
                hanging.push(Hanging { path: declared.path, first: execution.id, duration });
            }
        }
        hanging
    }

    /// Counts a command that begins; returns whether too many have begun at this instant of virtual time.
    pub(super) fn begins_too_often(&self) -> bool {
        if self.0.mode != Mode::Virtual {
            return false;
        }
        let now = self.0.clock.now();
        let mut begun = self.0.begun.lock().unwrap_or_else(PoisonError::into_inner);
        *begun = if begun.0 == now { (now, begun.1.saturating_add(1)) } else { (now, 1) };
        begun.1 > MOST_AT_ONCE
    }
}

/// No further command starts while this many cancelled executions have not returned from their code. The pool has as
/// many threads for commands. Other executions are bounded by the concurrency of their categories.
const MOST_LINGERING: usize = 512;

/// Additional limit for commands that disarm the robot or were started by health.
const MORE_FOR_SAFETY: usize = 512;

impl Step<'_> {
    /// Whether another command may start. A command that hangs leaves an execution running each time it is started
    /// and cancelled.
    pub(super) fn has_room(&self, role: Role, of_health: bool) -> Result<(), RefusalReason> {
        let is_for_safety = of_health || role == Role::Disarming;
        let most = if is_for_safety { MOST_LINGERING + MORE_FOR_SAFETY } else { MOST_LINGERING };
        let executions = self.state.executions.iter();
        let lingering = executions.filter(|execution| matches!(execution.phase, Phase::Lingering)).count();
        if lingering < most { Ok(()) } else { Err(RefusalReason::Hanging) }
    }

    /// The lane of the pool that runs a command.
    pub(super) fn lane(&self, command: usize, of_health: bool) -> Lane {
        match self.role(command) {
            Role::Disarming => Lane::Disarming,
            Role::Plain | Role::Arming if of_health => Lane::Health,
            Role::Plain | Role::Arming => Lane::Commands,
        }
    }
}
