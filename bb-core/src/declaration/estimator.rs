//! Estimators as declared: their inputs, their health, and the islands in which they run.

use crate::event::HealthState;
use crate::message::Frame;
use crate::topology::Transform;

/// An estimator as declared.
#[derive(Clone, Copy, Debug)]
pub struct EstimatorDeclaration {
    /// Path: `estimator/base_link/pose`.
    pub path: &'static str,
    /// The frame of what it publishes.
    pub frame: Frame,
    /// Inputs, in the order of their declaration. A nested estimator's only input is its sensor.
    pub inputs: &'static [InputDeclaration],
    /// The paths it publishes at: one per declared output, or its own.
    pub outputs: &'static [&'static str],
    /// The names of its outputs, in the same order: `out` for one that is not declared.
    pub output_names: &'static [&'static str],
    /// The number of the island that it runs in.
    pub island: usize,
    /// The number of its supervisor, see [`Supervisor`](super::Supervisor).
    pub supervisor: usize,
    /// The settings of its health.
    pub health: HealthDeclaration,
    /// Thread of its own, if it has one.
    pub worker: Option<WorkerDeclaration>,
}

impl EstimatorDeclaration {
    /// The input whose arrival triggers a dispatch.
    pub(crate) fn driver(&self) -> Option<&'static InputDeclaration> {
        self.inputs.iter().find(|input| input.driver)
    }

    /// Declaration without settings.
    pub(crate) const NONE: Self = Self {
        path: "",
        frame: Frame::NONE,
        inputs: &[],
        outputs: &[],
        output_names: &[],
        island: 0,
        supervisor: 0,
        health: HealthDeclaration::NONE,
        worker: None,
    };
}

/// The settings of an estimator's health.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HealthDeclaration {
    /// Longest time that a callback may take, in nanoseconds.
    pub latency_budget_nanos: Option<i64>,
    /// Time without a completed run on a driver message until the estimator is lost, in nanoseconds.
    pub lost_after_nanos: Option<i64>,
    /// Number of good completions in a row until the estimator is healthy again: at least 1.
    pub recover_after: u32,
    /// The number of the command that is started when it degrades.
    pub on_degraded: Option<usize>,
    /// … when it is lost.
    pub on_lost: Option<usize>,
    /// … when it is healthy again.
    pub on_recovered: Option<usize>,
}

impl HealthDeclaration {
    /// No settings.
    pub const NONE: Self = Self {
        latency_budget_nanos: None,
        lost_after_nanos: None,
        recover_after: 1,
        on_degraded: None,
        on_lost: None,
        on_recovered: None,
    };
}

impl Default for HealthDeclaration {
    fn default() -> Self {
        Self::NONE
    }
}

/// An island of estimators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IslandDeclaration {
    /// Number of the island.
    pub number: usize,
    /// The path of its first estimator.
    pub name: &'static str,
    /// Settings of the island's own thread, if it has one.
    pub worker: Option<WorkerDeclaration>,
    /// `true` if one of the estimators has a latency budget, so that callbacks are measured.
    pub is_measured: bool,
    /// The numbers of its estimators, in the order in which a message reaches them.
    pub estimators: &'static [usize],
    /// The publishers outside the island that feed it.
    pub inlets: &'static [InletDeclaration],
}

/// A publisher outside of an island, and the estimators that it feeds there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InletDeclaration {
    /// The publisher, as the island numbers them.
    pub entry: usize,
    /// Estimators of the island that take it, each with the number of the input.
    pub inputs: &'static [(usize, usize)],
}

/// `runs_on: worker`: how its thread runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkerDeclaration {
    /// The real-time priority of its thread, 1 to 99.
    pub priority: Option<u8>,
    /// The core that it runs on.
    pub core: Option<usize>,
}

/// One input as declared.
#[derive(Clone, Copy, Debug)]
pub struct InputDeclaration {
    /// Number among the declared inputs.
    pub index: usize,
    /// Name.
    pub name: &'static str,
    /// The path of its publisher.
    pub source: &'static str,
    /// `true` if the arrival of a message triggers a dispatch.
    pub driver: bool,
    /// `true` if the estimator is called without the input when it is missing or too old.
    pub optional: bool,
    /// Greatest age of a message relative to the driver's, in nanoseconds; `None` for any age.
    pub tolerance_nanos: Option<i64>,
    /// Greatest age of a message by the clock when it arrives, in nanoseconds; for the driver.
    pub stale_after_nanos: Option<i64>,
    /// Takes points from its frame to the output's; `None` if there is a moving joint between.
    pub frame_from_input: Option<Transform>,
}

impl InputDeclaration {
    /// The only input of a nested estimator: its sensor, which is in the same frame.
    pub const fn nested(name: &'static str, source: &'static str) -> Self {
        Self {
            index: 0,
            name,
            source,
            driver: true,
            optional: false,
            tolerance_nanos: None,
            stale_after_nanos: None,
            frame_from_input: Some(Transform::IDENTITY),
        }
    }

    /// Returns whether a message that is `age_nanos` older than the driver is too old. A newer one never is.
    pub(crate) fn is_too_old(&self, age_nanos: i64) -> bool {
        self.tolerance_nanos.is_some_and(|tolerance| age_nanos > tolerance)
    }
}

impl HealthDeclaration {
    /// The number of the command that a transition starts, if one is declared. `Lost` to `Degraded` starts none.
    pub(crate) fn command(&self, from: HealthState, to: HealthState) -> Option<usize> {
        match (from, to) {
            (HealthState::Healthy, HealthState::Degraded) => self.on_degraded,
            (_, HealthState::Lost) => self.on_lost,
            (HealthState::Degraded, HealthState::Healthy) => self.on_recovered,
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use HealthState::{Degraded, Healthy, Lost};

    #[test]
    fn only_the_way_down_and_the_way_to_healthy_start_commands() {
        let declaration = HealthDeclaration {
            on_degraded: Some(0),
            on_lost: Some(1),
            on_recovered: Some(2),
            ..Default::default()
        };
        let started = |from, to| declaration.command(from, to);
        assert_eq!(started(Healthy, Degraded), Some(0));
        assert_eq!(started(Lost, Degraded), None);
        assert_eq!((started(Healthy, Lost), started(Degraded, Lost)), (Some(1), Some(1)));
        assert_eq!(started(Degraded, Healthy), Some(2));
    }
}
