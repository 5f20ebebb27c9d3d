//! Conditions under which an estimator is degraded or lost, and the commands this starts.

use super::{CommandId, Robot};
use crate::language::EstimatorSetting;
use crate::parse::{Reaction, Reactions, RunsOn, Settings};

/// The numeric settings of an estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Timing {
    pub(crate) sync_tolerance_s: Option<f64>,
    pub(crate) latency_budget_s: Option<f64>,
    pub(crate) lost_after_s: Option<f64>,
    /// Number of good completions in a row that end a degradation.
    pub(crate) recover_after: u32,
}

/// The commands started by changes of its health: `None` if none is declared, or no command has the name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Health {
    pub(crate) on_degraded: Option<CommandId>,
    pub(crate) on_lost: Option<CommandId>,
    pub(crate) on_recovered: Option<CommandId>,
}

/// A separate thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Worker {
    /// 1 to 99, of the operating system's real-time class.
    pub(crate) priority: Option<u8>,
    /// The processor's core that it is bound to.
    pub(crate) core: Option<u32>,
}

impl Timing {
    /// Timing without any setting.
    pub(crate) const DEFAULT: Self =
        Self { sync_tolerance_s: None, latency_budget_s: None, lost_after_s: None, recover_after: 1 };

    pub(super) fn of(settings: &Settings<EstimatorSetting>) -> Self {
        let mut timing = Self::DEFAULT;
        for (setting, quantity) in settings.each() {
            let value = quantity.value;
            match setting {
                EstimatorSetting::SyncTolerance => timing.sync_tolerance_s = Some(value),
                EstimatorSetting::LatencyBudget => timing.latency_budget_s = Some(value),
                EstimatorSetting::LostAfter => timing.lost_after_s = Some(value),
                // A rule refuses other values; the cast saturates.
                EstimatorSetting::RecoverAfter => timing.recover_after = value as u32,
            }
        }
        timing
    }
}

impl Robot {
    pub(super) fn resolve_health(&self, reactions: &Reactions) -> Health {
        let command = |reactions: &[Reaction]| self.command(&reactions.first()?.command);
        let Reactions { on_degraded, on_lost, on_recovered } = reactions;
        Health { on_degraded: command(on_degraded), on_lost: command(on_lost), on_recovered: command(on_recovered) }
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
