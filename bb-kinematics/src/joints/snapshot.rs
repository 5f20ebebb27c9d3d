//! All joints at one time.

use super::history::State;
use super::states::States;
use super::store::Joints;
use crate::topology::JointKind;
use bb_message::payload::JointSnapshot;
use bb_message::time::MonotonicTime;

/// A joint whose state is known and not stale. Quantities not measured are NaN.
struct Listed {
    name: &'static str,
    position: f64,
    velocity: f64,
    effort: f64,
}

impl Joints {
    /// All joints with one degree of freedom whose state is known and not stale, at the newest time for which all of them are
    /// known. Returns `None` if there is no such joint. Velocities and efforts are from the newest states.
    pub fn snapshot(&self) -> Option<(MonotonicTime, JointSnapshot)> {
        // Allocate before the lock is taken.
        let mut listed = Vec::with_capacity(self.topology().joints.len());
        let time = self.list(&self.states().lock(), &mut listed)?;
        let mut snapshot = JointSnapshot::default();
        let mut names = Vec::with_capacity(listed.len());
        for joint in listed {
            names.push(joint.name.to_owned());
            snapshot.positions.push(joint.position);
            snapshot.velocities.push(joint.velocity);
            snapshot.efforts.push(joint.effort);
        }
        for list in [&mut snapshot.velocities, &mut snapshot.efforts] {
            if list.iter().any(|value| value.is_nan()) {
                list.clear();
            }
        }
        snapshot.names = names.into();
        Some((time, snapshot))
    }

    /// Lists the joints with a known state at the newest time that all fresh joints have reached; returns that time.
    fn list(&self, states: &States, listed: &mut Vec<Listed>) -> Option<MonotonicTime> {
        let now = self.clock().now();
        let topology = self.topology();
        let joints = topology.joints.iter().enumerate().filter(|(_, joint)| {
            matches!(joint.kind, JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic)
        });
        let fresh = joints.filter_map(|(number, joint)| {
            let followed = topology.followed(number);
            let history = states.history(followed.0)?;
            let newest = MonotonicTime::from_nanos(history.newest()?);
            let is_fresh = now.nanos_since(newest) <= self.stale_nanos();
            is_fresh.then_some((number, joint.name, followed, history, newest))
        });
        let time = fresh.clone().map(|(.., newest)| newest).min()?;
        for (number, name, (owner, multiplier, offset), history, _) in fresh {
            let mut position = [0.0];
            // The history of a joint that has only just begun does not reach back to the others.
            if history.sample(time, 0, &mut position).is_err() {
                continue;
            }
            let first = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
            let newest = history.newest_state();
            let (velocity, effort) = newest.map_or((f64::NAN, f64::NAN), |State { velocity, effort, .. }| {
                // The effort is the joint's own if it mimics no other joint.
                (multiplier * first(velocity), if owner == number { first(effort) } else { f64::NAN })
            });
            listed.push(Listed { name, position: multiplier * position[0] + offset, velocity, effort });
        }
        Some(time)
    }
}
