//! When an estimator counts as degraded or lost, and what that calls.

use super::{CommandId, Robot};
use crate::parse::{HealthSettings, Reaction, RunsOn};

#[derive(Clone, Debug)]
pub(crate) struct Health {
    /// As written.
    pub(crate) settings: HealthSettings,
    pub(crate) latency_budget_s: Option<f64>,
    pub(crate) lost_after_s: Option<f64>,
    /// How many good completions in a row end a degradation.
    pub(crate) recover_after: u32,
    /// None where nothing is to be called, or where no command has the name.
    pub(crate) on_degraded: Option<CommandId>,
    pub(crate) on_lost: Option<CommandId>,
    pub(crate) on_recovered: Option<CommandId>,
}

/// A thread of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Worker {
    /// 1 to 99, of the operating system's real-time class.
    pub(crate) priority: Option<u8>,
    /// The processor's core that it is bound to.
    pub(crate) core: Option<u32>,
}

impl Robot {
    pub(super) fn resolve_health(&self, settings: HealthSettings) -> Health {
        let command = |reactions: &[Reaction]| self.command(&reactions.first()?.command);
        Health {
            latency_budget_s: settings.latency_budgets.first().map(|budget| budget.quantity.value),
            lost_after_s: settings.lost_afters.first().map(|time| time.quantity.value),
            // A value that is no such number is refused; a cast saturates all the same.
            recover_after: settings.recover_afters.first().map_or(1, |count| count.quantity.value as u32),
            on_degraded: command(&settings.on_degraded),
            on_lost: command(&settings.on_lost),
            on_recovered: command(&settings.on_recovered),
            settings,
        }
    }
}

impl HealthSettings {
    /// All reactions, in the order of their words.
    pub(crate) fn all_reactions(&self) -> impl Iterator<Item = &Reaction> {
        self.on_degraded.iter().chain(&self.on_lost).chain(&self.on_recovered)
    }
}

impl Worker {
    pub(super) fn of(settings: &[RunsOn]) -> Option<Self> {
        let RunsOn { priority, core, .. } = settings.first()?;
        Some(Self {
            priority: priority.as_ref().map(|priority| priority.value as u8),
            core: core.as_ref().map(|core| core.value as u32),
        })
    }
}
