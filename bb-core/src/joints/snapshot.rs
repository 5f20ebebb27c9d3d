//! All joints at one time.

use super::history::State;
use super::states::States;
use super::store::Joints;
use crate::payload::JointSnapshot;
use crate::time::MonotonicTime;
use crate::topology::JointKind;

/// A joint whose state is known and not stale.
struct Listed {
    name: &'static str,
    /// The joint that it follows, itself if it mimics none, and what it makes of that one's position.
    owner: usize,
    multiplier: f64,
    offset: f64,
    /// Whether it mimics none: the effort is its own then.
    is_own: bool,
    newest: MonotonicTime,
}

impl Joints {
    /// All joints with one degree of freedom whose state is known and not stale, at the newest time that is known of all of
    /// them; none if there is no such joint. Velocities and efforts are those of the newest states.
    pub fn snapshot(&self) -> Option<(MonotonicTime, JointSnapshot)> {
        let states = self.states().lock();
        let listed = self.listed(&states);
        let time = listed.iter().map(|joint| joint.newest).min()?;
        let mut snapshot = JointSnapshot::default();
        let mut names = Vec::new();
        for joint in listed {
            let mut position = [0.0];
            let Some(history) = states.history(joint.owner) else { continue };
            // The history of one that has only begun does not reach back to the others.
            if history.sample(time, 0, &mut position).is_err() {
                continue;
            }
            let first = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
            let newest = history.newest_state();
            let (velocity, effort) = newest.map_or((f64::NAN, f64::NAN), |State { velocity, effort, .. }| {
                (joint.multiplier * first(velocity), if joint.is_own { first(effort) } else { f64::NAN })
            });
            names.push(joint.name.to_owned());
            snapshot.positions.push(joint.multiplier * position[0] + joint.offset);
            snapshot.velocities.push(velocity);
            snapshot.efforts.push(effort);
        }
        for list in [&mut snapshot.velocities, &mut snapshot.efforts] {
            if list.iter().any(|value| value.is_nan()) {
                list.clear();
            }
        }
        snapshot.names = names.into();
        Some((time, snapshot))
    }

    fn listed(&self, states: &States) -> Vec<Listed> {
        let now = self.clock().now();
        let topology = self.topology();
        let joints = topology.joints.iter().enumerate().filter(|(_, joint)| {
            matches!(joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic)
        });
        let listed = joints.filter_map(|(number, joint)| {
            let (owner, multiplier, offset) = topology.followed(number);
            let newest = MonotonicTime::from_nanos(states.history(owner)?.newest()?);
            let is_fresh = now.nanos_since(newest) <= self.stale_nanos();
            let is_own = owner == number;
            is_fresh.then_some(Listed { name: joint.name, owner, multiplier, offset, is_own, newest })
        });
        listed.collect()
    }
}
