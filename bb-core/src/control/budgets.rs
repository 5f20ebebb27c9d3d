//! Panic budgets. When a component exceeds its supervisor's budget, everything below that supervisor is restarted;
//! eventually the robot is disarmed.
//!
//! Supervisors mirror the topology: one for the robot, one for each link, one for each joint. The parent of a link's
//! supervisor is that of the joint that carries it; the parent of a joint's supervisor is that of the link it is
//! mounted on.

use crate::declaration::Supervisor;
use crate::lifecycle::Supervision;
use crate::time::MonotonicTime;
use crate::topology::Topology;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::{Joint, JointKind, Link, Origin};
    use std::time::Duration;

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
}
