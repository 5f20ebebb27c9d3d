//! What becomes of a component that has failed: it is started anew, alone and after a while; if that happens too often,
//! so is all that its supervisor looks after, and at last the robot is disarmed.
//!
//! Supervisors mirror the topology: one for the robot, one for each link, one for each joint. The parent of a link's is
//! that of the joint that carries it, the parent of a joint's is that of the link it is mounted on.

use crate::time::MonotonicTime;
use crate::topology::Topology;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How patiently components that fail are started anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Supervision {
    /// How many restarts a supervisor allows within [`Self::within`] before it gives up and its parent restarts all that
    /// it looks after. Default: 3.
    pub max_restarts: usize,
    /// See [`Self::max_restarts`]. Default: 5 s.
    pub within: Duration,
    /// How long the first restart of a component waits; each further one in a row twice as long. Default: 10 ms.
    pub first_backoff: Duration,
    /// How long a restart waits at most. Default: 250 ms.
    pub longest_backoff: Duration,
}

impl Default for Supervision {
    fn default() -> Self {
        Self {
            max_restarts: 3,
            within: Duration::from_secs(5),
            first_backoff: Duration::from_millis(10),
            longest_backoff: Duration::from_millis(250),
        }
    }
}

/// The number of a supervisor: 0 for the robot, then the links, then the joints, in the order of the topology.
pub type Supervisor = usize;

/// How often in a row a component has failed, and when last.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Failures {
    count: u32,
    last: MonotonicTime,
}

/// What a supervisor decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// That component alone.
    Restart,
    /// All that this supervisor and those below it look after.
    RestartAll(Supervisor),
    /// The robot has used up its budget.
    GiveUp,
}

#[derive(Clone, Debug)]
pub(crate) struct Supervisors {
    settings: Supervision,
    parents: Arc<[Option<Supervisor>]>,
    /// When each has last restarted something.
    restarts: Arc<Mutex<Vec<VecDeque<MonotonicTime>>>>,
}

impl Supervisors {
    pub(crate) fn new(topology: &Topology, settings: Supervision) -> Self {
        let links = topology.links.len();
        let of_links =
            topology.links.iter().map(|link| Some(link.parent_joint.map_or(0, |joint| 1 + links + joint)));
        let of_joints = topology.joints.iter().map(|joint| Some(1 + joint.parent));
        let parents: Arc<[_]> = std::iter::once(None).chain(of_links).chain(of_joints).collect();
        let restarts = Arc::new(Mutex::new(vec![VecDeque::new(); parents.len()]));
        Self { settings, parents, restarts }
    }

    /// Takes the failure of a component that `supervisor` looks after.
    pub(crate) fn failed(&self, supervisor: Supervisor, now: MonotonicTime) -> Verdict {
        let mut restarts = self.restarts.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut current, mut verdict) = (supervisor, Verdict::Restart);
        loop {
            let Some(past) = restarts.get_mut(current) else { return Verdict::GiveUp };
            past.retain(|time| now.duration_since(*time) < self.settings.within);
            if past.len() < self.settings.max_restarts {
                past.push_back(now);
                return verdict;
            }
            // Until some of its restarts are long enough ago, what fails below it goes up at once.
            let Some(Some(parent)) = self.parents.get(current).copied() else { return Verdict::GiveUp };
            verdict = Verdict::RestartAll(current);
            current = parent;
        }
    }

    /// Whether `component`'s supervisor is `above` or stands below it.
    pub(crate) fn is_below(&self, component: Supervisor, above: Supervisor) -> bool {
        std::iter::successors(Some(component), |current| self.parents.get(*current).copied().flatten())
            .any(|current| current == above)
    }

    /// When a component that has failed now is to be made anew.
    pub(crate) fn restart_at(&self, failures: &mut Failures, now: MonotonicTime) -> MonotonicTime {
        // After so long without a failure the next one is the first again.
        if now.duration_since(failures.last) > self.settings.within {
            failures.count = 0;
        }
        let at = now + self.backoff(failures.count);
        *failures = Failures { count: failures.count.saturating_add(1), last: now };
        at
    }

    /// How long the restart number `attempt` in a row waits, from 0.
    fn backoff(&self, attempt: u32) -> Duration {
        let factor = 1_u32.checked_shl(attempt).unwrap_or(u32::MAX);
        self.settings.first_backoff.saturating_mul(factor).min(self.settings.longest_backoff)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::{Joint, JointKind, Link, Origin};

    const fn link(name: &'static str, parent_joint: Option<usize>) -> Link {
        Link { name, parent_joint, root_from_link: None, inertial: None, visuals: &[], collisions: &[] }
    }

    /// A base that carries an arm: supervisors 0 robot, 1 base, 2 arm, 3 shoulder.
    fn supervisors() -> Supervisors {
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
        Supervisors::new(&TOPOLOGY, Supervision { max_restarts: 1, ..Supervision::default() })
    }

    #[test]
    fn failures_that_come_too_often_go_up_supervisor_by_supervisor() {
        let supervisors = supervisors();
        let verdicts: Vec<_> = (0..5).map(|_| supervisors.failed(2, MonotonicTime::ZERO)).collect();
        let all = Verdict::RestartAll;
        // Every supervisor allows one: the arm's, the joint's for the arm, the base's for the joint, the robot's for all.
        assert_eq!(verdicts, [Verdict::Restart, all(2), all(3), all(1), Verdict::GiveUp]);
    }

    #[test]
    fn failures_far_apart_never_go_up() {
        let supervisors = supervisors();
        for seconds in (0..100).step_by(6) {
            let now = MonotonicTime::ZERO + Duration::from_secs(seconds);
            assert_eq!(supervisors.failed(2, now), Verdict::Restart);
        }
    }

    #[test]
    fn backoff_doubles_up_to_its_bound() {
        let supervisors = supervisors();
        let backoff = |attempt| supervisors.backoff(attempt).as_millis();
        assert_eq!([backoff(0), backoff(1), backoff(2), backoff(7), backoff(200)], [10, 20, 40, 250, 250]);
    }

    #[test]
    fn a_supervisor_looks_after_all_below_it() {
        let supervisors = supervisors();
        assert!(supervisors.is_below(2, 3) && supervisors.is_below(2, 1) && supervisors.is_below(2, 0));
        assert!(!supervisors.is_below(1, 2));
    }
}
