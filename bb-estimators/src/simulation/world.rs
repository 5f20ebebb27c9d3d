//! The world of simulated components: the motion of the joints.

use super::plant::{Drivetrain, Goal, Plant, PlantState};
use crate::motion::JointPoint;
use bb_core::topology::Topology;
use bb_core::{Fault, MonotonicTime};
use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The joints of a simulated robot, moved by [`SimulatedActuator`](super::SimulatedActuator)s and measured by
/// simulated sensors.
///
/// The simulated components of a run share it: `context.shared(|| SimulatedWorld::new(context.topology()))`, and from
/// outside `simulation.shared(|| SimulatedWorld::new(Arm::TOPOLOGY))`. A joint without an actuator rests at zero.
/// Each joint moves independently: neither the other joints nor gravity affect it.
pub struct SimulatedWorld {
    topology: &'static Topology,
    state: Mutex<State>,
}

struct State {
    /// By joint; `None` if nothing moves it.
    plants: Vec<Option<Plant>>,
    unplugged: BTreeSet<String>,
}

/// A simulated joint: its true state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SimulatedJoint {
    /// Its position and motion.
    pub point: JointPoint,
    /// Effort of its motor, N·m or N.
    pub effort: f64,
}

impl SimulatedWorld {
    /// The world of a robot, in which nothing moves yet.
    pub fn new(topology: &'static Topology) -> Self {
        let plants = topology.joints.iter().map(|_| None).collect();
        Self { topology, state: Mutex::new(State { plants, unplugged: BTreeSet::new() }) }
    }

    /// The links and joints.
    pub fn topology(&self) -> &'static Topology {
        self.topology
    }

    /// The true state of a joint at a time. One that mimics another follows it.
    ///
    /// # Errors
    /// There is no such joint.
    pub fn joint(&self, name: &str, now: MonotonicTime) -> Result<SimulatedJoint, Fault> {
        Ok(self.joint_at(self.number(name)?, now))
    }

    /// The same by number.
    pub(super) fn joint_at(&self, joint: usize, now: MonotonicTime) -> SimulatedJoint {
        let (owner, multiplier, offset) = self.topology.followed(joint);
        let mut state = self.lock();
        let plant = state.plants.get_mut(owner).and_then(Option::as_mut);
        let PlantState { point, effort, .. } = plant.map_or_else(PlantState::default, |plant| plant.at(now));
        SimulatedJoint {
            point: JointPoint {
                position: multiplier * point.position + offset,
                velocity: multiplier * point.velocity,
                acceleration: multiplier * point.acceleration,
            },
            effort: if owner == joint { effort } else { 0.0 },
        }
    }

    /// Puts obstacles at both sides of a joint from `now` on: it stays between these positions, rad or m. Infinite ones remove
    /// them.
    ///
    /// # Errors
    /// There is no such joint, or nothing moves it.
    pub fn obstruct(&self, name: &str, lower: f64, upper: f64, now: MonotonicTime) -> Result<(), Fault> {
        let joint = self.number(name)?;
        let mut state = self.lock();
        let plant = state.plants.get_mut(joint).and_then(Option::as_mut);
        let plant = plant.ok_or_else(|| Fault::new(format!("no simulated actuator moves the joint `{name}`")))?;
        plant.obstruct(lower, upper, now);
        Ok(())
    }

    /// Unplugs the simulated sensor at `path`, or plugs it in again: while it is unplugged, its readings fail.
    pub fn set_unplugged(&self, path: &str, is_unplugged: bool) {
        let mut state = self.lock();
        if is_unplugged {
            state.unplugged.insert(path.to_owned());
        } else {
            state.unplugged.remove(path);
        }
    }

    /// # Errors
    /// The sensor is unplugged.
    pub(super) fn check_plugged(&self, path: &str) -> Result<(), Fault> {
        if self.lock().unplugged.contains(path) {
            return Err(Fault::new("the device is unplugged"));
        }
        Ok(())
    }

    /// Adds a motor to a joint, at `position`. A motor already there, from an actuator that is restarted, is left
    /// where it is.
    pub(super) fn add(
        &self,
        name: &str,
        drivetrain: Drivetrain,
        position: f64,
        now: MonotonicTime,
    ) -> Result<usize, Fault> {
        let joint = self.number(name)?;
        let mut state = self.lock();
        if let Some(slot) = state.plants.get_mut(joint) {
            match slot {
                Some(plant) => plant.drivetrain = drivetrain,
                None => *slot = Some(Plant::new(drivetrain, position, now)),
            }
        }
        Ok(joint)
    }

    /// Gives a motor a goal.
    pub(super) fn set_goal(&self, joint: usize, goal: Goal, now: MonotonicTime) {
        if let Some(plant) = self.lock().plants.get_mut(joint).and_then(Option::as_mut) {
            plant.set(goal, now);
        }
    }

    /// The state of a motor, and whether it has reached the end of its goal by itself.
    pub(super) fn motor(&self, joint: usize, now: MonotonicTime) -> (PlantState, Goal) {
        let mut state = self.lock();
        let plant = state.plants.get_mut(joint).and_then(Option::as_mut);
        plant.map_or((PlantState::default(), Goal::Free), |plant| (plant.at(now), plant.goal.clone()))
    }

    fn number(&self, name: &str) -> Result<usize, Fault> {
        let number = self.topology.joints.iter().position(|joint| joint.name == name);
        number.ok_or_else(|| Fault::permanent(format!("there is no joint `{name}`")))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for SimulatedWorld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedWorld").finish_non_exhaustive()
    }
}
