//! Problems of a robot at the moment, with their beginning and their reason, the worst first.

use super::Report;
use crate::control::ReportedSafetyError;
use crate::event::{HealthReason, HealthState, Safety};
use crate::time::MonotonicTime;
use std::cmp::Reverse;
use std::fmt;

/// Severity of a [`Problem`]. The worst compares as the least.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Severity {
    /// The safety state is `error`.
    Unsafe,
    /// A component has stopped, or waits for its restart.
    Stopped,
    /// An estimator is lost.
    Lost,
    /// An estimator is degraded.
    Degraded,
    /// A command was refused, and has not been started since.
    Refused,
}

impl Severity {
    /// Returns the name in JSON: `unsafe`, `stopped`, `lost`, `degraded` or `refused`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unsafe => "unsafe",
            Self::Stopped => "stopped",
            Self::Lost => "lost",
            Self::Degraded => "degraded",
            Self::Refused => "refused",
        }
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Something that is wrong at the moment of a [`Report`].
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Problem {
    /// The path of the component or the command; `safety` if no component is known to have caused it.
    pub path: String,
    /// Severity.
    pub severity: Severity,
    /// Beginning, if it is known.
    pub since: Option<MonotonicTime>,
    /// The reason for people.
    pub reason: String,
}

impl Report {
    /// Returns the problems of the moment, the worst first, and of equally bad ones the newest first.
    ///
    /// ```
    /// use bb_core::prelude::*;
    /// use bb_core::run::Severity;
    /// # #[derive(Debug)] struct Pass;
    /// # impl Estimator for Pass {
    /// #     type Options = NoOptions;
    /// #     type Input = Imu;
    /// #     type Output = Imu;
    /// #     fn init(_: NoOptions, _: &Context) -> Result<Self, Fault> { Ok(Self) }
    /// #     fn handle_input(&mut self, imu: &Stamped<Imu>) -> Result<Reply<Imu>, Fault> { Ok(Reply::emit(imu.payload)) }
    /// # }
    /// robot! {
    ///     robot Rig;
    ///     link base {
    ///         sensor imu: External<Imu>();
    ///         estimator pass: Pass() { input imu: sensor::base::imu; lost_after: 100 ms; }
    ///     }
    /// }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut rig = Rig::builder().simulate()?;
    /// rig.run_until(MonotonicTime::from_nanos(10_000_000_000));
    /// let problems = rig.report().problems();
    /// assert_eq!((problems[0].severity, problems[0].path.as_str()), (Severity::Lost, "estimator/base/pass"));
    /// assert_eq!(problems[0].since, Some(MonotonicTime::from_nanos(100_000_000)));
    /// # Ok(())
    /// # }
    /// ```
    pub fn problems(&self) -> Vec<Problem> {
        let mut problems = self.unsafe_components();
        for estimator in &self.estimators {
            let last = estimator.last_transition;
            let since = last.map(|last| last.time);
            // One that was left out is not part of the robot.
            let Some(health) = estimator.health else { continue };
            if let Some(stopped) = &estimator.stopped {
                add(&mut problems, estimator.path, Severity::Stopped, since, stopped.clone());
                continue;
            }
            let severity = match health {
                HealthState::Healthy => continue,
                HealthState::Degraded => Severity::Degraded,
                HealthState::Lost => Severity::Lost,
            };
            let mut reason = last.map_or_else(String::new, |last| reason_of(last.reason, last.source));
            if let Some((input, drop)) = estimator.last_drop {
                reason += &format!("; `{input}` was dropped last: {}", drop.name());
            }
            match (last.map(|last| last.reason), &estimator.last_gap, estimator.last_divergence) {
                (Some(HealthReason::NoTransform), Some(gap), _) => reason += &format!("; {gap}"),
                (Some(HealthReason::Diverged), _, Some(divergence)) => reason += &format!("; {divergence}"),
                _ => {}
            }
            add(&mut problems, estimator.path, severity, since, reason);
        }
        for source in self.sources.iter().filter(|source| source.failing_since.is_some()) {
            let reason =
                source.stopped.clone().unwrap_or_else(|| "it was restarted, and has not been read yet".to_owned());
            add(&mut problems, source.path, Severity::Stopped, source.failing_since, reason);
        }
        for actuator in &self.actuators {
            if let Some(reason) = &actuator.stopped {
                let since = self.failed_since(actuator.path);
                add(&mut problems, actuator.path, Severity::Stopped, since, reason.clone());
            }
        }
        for command in &self.commands {
            if let (Some(since), Some(refusal)) = (command.refused_at, &command.last_refusal) {
                let path = format!("command/{}", command.name);
                add(&mut problems, &path, Severity::Refused, Some(since), refusal.to_string());
            }
        }
        problems
    }

    /// The causes of the safety state `error`, if the robot is in it.
    fn unsafe_components(&self) -> Vec<Problem> {
        let mut problems = Vec::new();
        if self.safety != Safety::Error {
            return problems;
        }
        if self.safety_errors.is_empty() {
            add(&mut problems, "safety", Severity::Unsafe, None, "the robot could not be made safe".to_owned());
        }
        for ReportedSafetyError { last, last_time, .. } in &self.safety_errors {
            add(&mut problems, last.path, Severity::Unsafe, Some(*last_time), last.error.to_string());
        }
        problems
    }

    /// The time of the last fault of a component.
    fn failed_since(&self, path: &str) -> Option<MonotonicTime> {
        self.faults.iter().rev().find(|fault| fault.path == path).map(|fault| fault.last_time)
    }
}

/// Adds a problem behind those that are worse, or as bad and newer.
fn add(problems: &mut Vec<Problem>, path: &str, severity: Severity, since: Option<MonotonicTime>, reason: String) {
    let rank = |problem: &Problem| (problem.severity, problem.since.map(Reverse));
    let problem = Problem { path: path.to_owned(), severity, since, reason };
    let place = problems.partition_point(|other| rank(other) <= rank(&problem));
    problems.insert(place, problem);
}

/// A change of health in words.
fn reason_of(reason: HealthReason, source: &str) -> String {
    match reason {
        HealthReason::Lost => format!("no run on a message of `{source}`"),
        HealthReason::Recovered => "it runs again, and has not yet had enough good runs".to_owned(),
        other => format!("{other} (`{source}`)"),
    }
}
