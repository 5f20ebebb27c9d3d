//! Faults: those that a report lists, and what panics lead to.
//!
//! Panics have budgets. When a component exceeds its supervisor's budget, everything below that supervisor is restarted; eventually the
//! robot is disarmed. Supervisors mirror the topology: one for the robot, one for each link, one for each joint. The parent of a link's
//! supervisor is that of the joint that carries it; the parent of a joint's supervisor is that of the link it is mounted on.

use crate::declaration::Supervisor;
use crate::event::{ComponentFault, SafetyError};
use crate::lifecycle::Supervision;
use crate::time::MonotonicTime;
use crate::topology::Topology;
use std::collections::VecDeque;
use std::fmt;
use std::time::Duration;

/// The number of faults that are kept. Earlier ones are only counted.
const KEPT: usize = 256;

/// A fault of a component, and how often it occurred before the component had another one.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ReportedFault {
    /// The path of the component.
    pub path: &'static str,
    /// Message of the fault.
    pub message: String,
    /// Number of times that the fault occurred.
    pub count: u64,
    /// Time of the first occurrence.
    pub first_time: MonotonicTime,
    /// Time of the last occurrence.
    pub last_time: MonotonicTime,
}

impl From<ReportedFault> for ComponentFault {
    fn from(ReportedFault { path, message, .. }: ReportedFault) -> Self {
        Self { path, message }
    }
}

impl fmt::Display for ReportedFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, message, count, first_time, last_time } = self;
        write!(f, "{path} failed: {message}")?;
        if *count > 1 {
            let nanos = last_time.nanos_since(*first_time).max(0).unsigned_abs();
            write!(f, " ({count} times in {:.3} s)", Duration::from_nanos(nanos).as_secs_f64())?;
        }
        Ok(())
    }
}

/// The errors of one kind of a component that have made the safety state `error`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReportedSafetyError {
    /// The last of them.
    pub last: SafetyError,
    /// Number of them.
    pub count: u64,
    /// Time of the last one.
    pub last_time: MonotonicTime,
}

impl fmt::Display for ReportedSafetyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { last: SafetyError { path, error }, count, .. } = self;
        write!(f, "{path} was unsafe: {error}")?;
        if *count > 1 { write!(f, " ({count} times)") } else { Ok(()) }
    }
}

/// Errors that have made the safety state `error`, by component and kind, in the order in which they occurred first.
#[derive(Debug, Default)]
pub(super) struct SafetyErrors(Vec<ReportedSafetyError>);

impl SafetyErrors {
    pub(super) fn add(&mut self, error: SafetyError, now: MonotonicTime) {
        let key = |error: &SafetyError| (error.path, error.error.kind);
        let has_room = self.0.len() < KEPT;
        match self.0.iter_mut().find(|known| key(&known.last) == key(&error)) {
            Some(known) => *known = ReportedSafetyError { last: error, count: known.count + 1, last_time: now },
            None if has_room => self.0.push(ReportedSafetyError { last: error, count: 1, last_time: now }),
            None => {}
        }
    }

    pub(super) fn all(&self) -> Vec<ReportedSafetyError> {
        self.0.clone()
    }
}

/// The newest faults in the order in which they occurred last, and the number of all faults.
#[derive(Debug, Default)]
pub(super) struct Faults {
    newest: VecDeque<ReportedFault>,
    count: u64,
}

impl Faults {
    /// Adds a fault. If it equals the last one of its component, it is counted there: a driver that retries does not displace the
    /// faults of others.
    pub(super) fn add(&mut self, ComponentFault { path, message }: ComponentFault, now: MonotonicTime) {
        self.count += 1;
        let last = self.newest.iter().rposition(|fault| fault.path == path);
        let same = last.filter(|index| self.newest[*index].message == message);
        let fault = match same.and_then(|index| self.newest.remove(index)) {
            Some(mut fault) => {
                fault.count += 1;
                fault.last_time = now;
                fault
            }
            None => ReportedFault { path, message, count: 1, first_time: now, last_time: now },
        };
        if self.newest.len() == KEPT {
            self.newest.pop_front();
        }
        self.newest.push_back(fault);
    }

    pub(super) fn newest(&self) -> Vec<ReportedFault> {
        self.newest.iter().cloned().collect()
    }

    pub(super) fn count(&self) -> u64 {
        self.count
    }
}

/// The decision of a supervisor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Restart that component alone.
    Restart,
    /// Restart all components of this supervisor and of those below it.
    RestartAll(Supervisor),
    /// The robot has exhausted its budget.
    GiveUp,
}

/// The budgets of all supervisors.
#[derive(Debug)]
pub(super) struct Budgets {
    settings: Supervision,
    parents: Vec<Option<Supervisor>>,
    /// The most recent panics that each has allowed.
    panics: Vec<Vec<MonotonicTime>>,
}

impl Budgets {
    pub(super) fn new(topology: &Topology, settings: Supervision) -> Self {
        let links = topology.links.len();
        let mut parents = vec![None];
        for link in topology.links {
            parents.push(Some(link.parent_joint.map_or(0, |joint| 1 + links + joint)));
        }
        for joint in topology.joints {
            parents.push(Some(1 + joint.parent));
        }
        let panics = vec![Vec::new(); parents.len()];
        Self { settings, parents, panics }
    }

    /// A component of `supervisor` has panicked.
    pub(super) fn panicked(&mut self, supervisor: Supervisor, now: MonotonicTime) -> Verdict {
        let mut current = supervisor;
        let mut verdict = Verdict::Restart;
        loop {
            let Some(past) = self.panics.get_mut(current) else { return Verdict::GiveUp };
            past.retain(|time| now.duration_since(*time) < self.settings.within);
            if past.len() < self.settings.max_restarts {
                past.push(now);
                return verdict;
            }
            // Until some of these have expired, further panics escalate at once.
            let Some(Some(parent)) = self.parents.get(current).copied() else { return Verdict::GiveUp };
            verdict = Verdict::RestartAll(current);
            current = parent;
        }
    }

    /// Returns whether `component`'s supervisor is `above` or below it.
    pub(super) fn is_below(&self, component: Supervisor, above: Supervisor) -> bool {
        std::iter::successors(Some(component), |current| self.parents.get(*current).copied().flatten())
            .any(|current| current == above)
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::topology::{Joint, JointKind, Link, Origin};
    use bb_tests::laws;
    use proptest::prelude::*;

    const PATHS: [&str; 3] = ["sensor/a", "sensor/b", "sensor/c"];

    fn faults(all: &[(usize, u64)]) -> Faults {
        let mut faults = Faults::default();
        for (nanos, (path, message)) in all.iter().enumerate() {
            let fault = ComponentFault { path: PATHS[*path], message: message.to_string() };
            faults.add(fault, MonotonicTime::from_nanos(nanos as i64 * 1_000_000));
        }
        faults
    }

    #[test]
    fn retries_of_two_drivers_are_two_lines() {
        let all: Vec<_> = (0..1000).map(|retry| (retry % 2, 7)).collect();
        let texts: Vec<_> = faults(&all).newest().iter().map(ToString::to_string).collect();
        assert_eq!(
            texts,
            ["sensor/a failed: 7 (500 times in 0.998 s)", "sensor/b failed: 7 (500 times in 0.998 s)"]
        );
    }

    #[test]
    fn a_fault_between_two_equal_ones_of_its_component_parts_them() {
        let newest = faults(&[(0, 1), (0, 2), (1, 1), (0, 1)]).newest();
        let seen: Vec<_> = newest.iter().map(|fault| (fault.path, fault.message.as_str(), fault.count)).collect();
        assert_eq!(seen, [("sensor/a", "1", 1), ("sensor/a", "2", 1), ("sensor/b", "1", 1), ("sensor/a", "1", 1)]);
    }

    const fn link(name: &'static str, parent_joint: Option<usize>) -> Link {
        Link { name, parent_joint, root_from_link: None, inertial: None, visuals: &[], collisions: &[] }
    }

    /// A base that carries an arm: supervisors 0 robot, 1 base, 2 arm, 3 shoulder.
    fn budgets() -> Budgets {
        const TOPOLOGY: Topology = Topology {
            links: &[link("base", None), link("arm", Some(0))],
            joints: &[Joint {
                name: "shoulder",
                kind: JointKind::Fixed,
                parent: 0,
                child: 1,
                parent_from_joint: Origin::IDENTITY,
                axis: None,
                limit: None,
                dynamics: None,
                mimic: None,
                transmission: None,
            }],
        };
        Budgets::new(&TOPOLOGY, Supervision { max_restarts: 1, ..Supervision::default() })
    }

    #[test]
    fn panics_that_come_too_often_go_up_supervisor_by_supervisor() {
        let mut supervisors = budgets();
        let verdicts: Vec<_> = (0..5).map(|_| supervisors.panicked(2, MonotonicTime::ZERO)).collect();
        let all = Verdict::RestartAll;
        // Every supervisor allows one: the arm's, the joint's for the arm, the base's for the joint, the robot's for all.
        assert_eq!(verdicts, [Verdict::Restart, all(2), all(3), all(1), Verdict::GiveUp]);
    }

    #[test]
    fn panics_far_apart_never_go_up() {
        let mut supervisors = budgets();
        for seconds in (0..100).step_by(6) {
            let now = MonotonicTime::ZERO + Duration::from_secs(seconds);
            assert_eq!(supervisors.panicked(2, now), Verdict::Restart);
        }
    }

    #[test]
    fn a_supervisor_restarts_all_below_it() {
        let supervisors = budgets();
        assert!(supervisors.is_below(2, 3) && supervisors.is_below(2, 1) && supervisors.is_below(2, 0));
        assert!(!supervisors.is_below(1, 2));
    }

    laws! {
        /// No fault is uncounted; of each component, no two neighbours are equal, and its last line is its last fault.
        #[test]
        fn groups_hold_all_faults_in_order(all in prop::collection::vec((0..3_usize, 0..3_u64), 0..200)) {
            let faults = faults(&all);
            let newest = faults.newest();
            prop_assert_eq!(faults.count(), all.len() as u64);
            prop_assert_eq!(newest.iter().map(|fault| fault.count).sum::<u64>(), all.len() as u64);
            prop_assert!(newest.is_sorted_by(|one, other| one.last_time < other.last_time));
            for (number, path) in PATHS.iter().enumerate() {
                let of_path = || all.iter().filter(|(path, _)| *path == number).map(|(_, message)| message.to_string());
                let messages: Vec<String> = of_path().collect();
                let groups: Vec<_> = newest.iter().filter(|fault| fault.path == *path).collect();
                let again: Vec<String> =
                    groups.iter().flat_map(|group| vec![group.message.clone(); group.count as usize]).collect();
                prop_assert_eq!(messages, again);
                prop_assert!(groups.windows(2).all(|pair| pair[0].message != pair[1].message));
            }
        }

        /// The newest 256 different faults are kept.
        #[test]
        fn the_oldest_make_room(count in 1..600_u64) {
            let all: Vec<_> = (0..count).map(|message| (0, message)).collect();
            let faults = faults(&all);
            let kept: Vec<_> = faults.newest().into_iter().map(|fault| fault.message).collect();
            let expected: Vec<_> = (count.saturating_sub(KEPT as u64)..count).map(|message| message.to_string()).collect();
            prop_assert_eq!(kept, expected);
        }
    }
}
