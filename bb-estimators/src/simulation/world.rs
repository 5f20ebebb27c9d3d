//! The world of simulated components: the motion of the joints and of the root.

use super::GRAVITY;
use super::coupling::{Coupling, JointVectors};
use super::fault::GnssFault;
use super::plant::{Drivetrain, Goal, Plant, PlantState, STEP, last_step};
use super::root::RootMotion;
use crate::motion::JointPoint;
use bb_core::kinematics::{Frames, Kinematics, LinkMotion};
use bb_core::topology::Topology;
use bb_core::{Clock, Fault, MonotonicTime};
use nalgebra::{Isometry3, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The most work done while the lock is held: steps of a joint by itself, or [sweeps](Coupling::sweeps) over coupled joints. That
/// is some tens of microseconds, or up to a few milliseconds. Commands and disarming wait for it.
const MOST_WORK: u64 = 1000;

/// The joints of a simulated robot, moved by [`SimulatedActuator`](super::SimulatedActuator)s and measured by
/// simulated sensors.
///
/// The simulated components of a run share it: `context.shared(|| SimulatedWorld::new(context.topology()))`, and from
/// outside `simulation.shared(|| SimulatedWorld::new(Arm::TOPOLOGY))`. A joint without an actuator rests at zero.
///
/// If links declare their `inertial`, gravity, the motion of other joints and that of the root load each joint, as they
/// would a rigid robot. Otherwise each joint moves independently, with the inertia that its actuator is given.
///
/// The root link rests at the origin of the world, whose z points up, unless [`Self::move_root`] moves it.
///
/// ```
/// use bb_core::nalgebra::Isometry3;
/// use bb_core::prelude::*;
/// use bb_estimators::SimulatedLinkImu;
/// use bb_estimators::simulation::SimulatedWorld;
///
/// robot! {
///     robot Cart;
///     link base { sensor imu: SimulatedLinkImu() { rate: 100 Hz; } }
/// }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut simulation = Cart::builder().simulate()?;
/// let world = simulation.shared(|| SimulatedWorld::new(Cart::TOPOLOGY));
/// world.move_root(MonotonicTime::ZERO, |time_s| Isometry3::translation(0.5 * time_s * time_s, 0.0, 0.0));
/// simulation.run_for(Duration::from_secs(2)); // its IMU measures 1 m/s² ahead
/// let truth = world.pose("base", simulation.clock().now())?;
/// assert!((truth.translation.x - 2.0).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
pub struct SimulatedWorld {
    topology: &'static Topology,
    state: Mutex<State>,
}

pub(super) struct State {
    /// Plants by joint; `None` if nothing moves it.
    plants: Vec<Option<Plant>>,
    /// `None` if no link that moves has a mass.
    pub(super) coupling: Option<Coupling>,
    /// The beginning of the present step of all plants, if they are coupled.
    time: MonotonicTime,
    /// The clock of the run, known from the first actuator on.
    clock: Option<Clock>,
    /// Time at which the run begins, as far as is known: nothing moves before.
    start: MonotonicTime,
    root: RootMotion,
    /// m/s², in the world.
    gravity: Vector3<f64>,
    unplugged: BTreeSet<String>,
    gnss_faults: BTreeMap<String, GnssFault>,
    slips: BTreeMap<String, f64>,
}

impl State {
    /// Makes all joints begin with the run. Those of actuators that are created earlier, on virtual time before the first stamp of a
    /// recording, rest until then.
    fn begin(&mut self) {
        let Some(start) = self.clock.as_ref().map(Clock::start).filter(|start| *start > self.start) else { return };
        self.start = start;
        self.time = self.time.max(start);
        self.plants.iter_mut().flatten().for_each(|plant| plant.skip_to(start));
    }

    /// Integrates a joint, and all that are coupled to it, up to the last whole step before `now`, with `most` work at most. Returns
    /// whether it got there; what remains of the last step a plant does by itself. Steps in which nothing changes are skipped.
    pub(super) fn advance(&mut self, joint: usize, now: MonotonicTime, most: u64) -> bool {
        self.begin();
        if self.plants.iter().all(Option::is_none) {
            self.time = self.time.max(now);
            return true;
        }
        let Some(begun) = self.coupling.as_ref().map(Coupling::sweeps) else {
            let plant = self.plants.get_mut(joint).and_then(Option::as_mut);
            return plant.is_none_or(|plant| plant.advance(now, most));
        };
        while self.coupling.as_ref().is_some_and(|coupling| coupling.sweeps() - begun < most) {
            let next = self.time + STEP;
            if next > now {
                return true;
            }
            if self.begin_step(next) && self.root.is_at_rest() {
                self.time = last_step(next, now);
                self.plants.iter_mut().flatten().for_each(|plant| plant.skip_to(self.time));
            }
        }
        self.time + STEP > now
    }

    /// Begins a step of all coupled plants at `now`. Returns whether it is as the last one.
    fn begin_step(&mut self, now: MonotonicTime) -> bool {
        let Self { plants, coupling, time, root, gravity, .. } = self;
        let Some(coupling) = coupling else { return false };
        let mut is_constant = true;
        for plant in plants.iter_mut().flatten() {
            is_constant &= plant.begin_step(now);
        }
        *time = now.max(*time);
        coupling.load(plants, root, gravity, *time);
        is_constant && plants.iter().flatten().all(Plant::is_loaded_as_before)
    }

    /// Changes something at `now`, with which a new step begins. All joints have been integrated up to then.
    fn change<T>(&mut self, now: MonotonicTime, change: impl FnOnce(&mut Self) -> T) -> T {
        if self.coupling.is_some() {
            self.plants.iter_mut().flatten().for_each(|plant| {
                plant.begin_step(now);
            });
        }
        let changed = change(self);
        self.begin_step(now);
        changed
    }
}

/// A simulated joint: its true state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SimulatedJoint {
    /// Position and motion of the joint.
    pub point: JointPoint,
    /// Effort of its motor, N·m or N.
    pub effort: f64,
}

impl SimulatedWorld {
    /// The world of a robot, in which nothing moves yet.
    pub fn new(topology: &'static Topology) -> Self {
        let state = State {
            plants: topology.joints.iter().map(|_| None).collect(),
            coupling: Coupling::new(topology),
            time: MonotonicTime::ZERO,
            clock: None,
            start: MonotonicTime::ZERO,
            root: RootMotion::default(),
            gravity: Vector3::new(0.0, 0.0, -GRAVITY),
            unplugged: BTreeSet::new(),
            gnss_faults: BTreeMap::new(),
            slips: BTreeMap::new(),
        };
        Self { topology, state: Mutex::new(state) }
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

    /// Returns the true state of the joint with this number.
    pub(super) fn joint_at(&self, joint: usize, now: MonotonicTime) -> SimulatedJoint {
        let (owner, multiplier, offset) = self.topology.followed(joint);
        let mut state = self.advanced(owner, now);
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

    /// The pose of a link, `world_from_link`, at a time.
    ///
    /// # Errors
    /// There is no such link.
    pub fn pose(&self, link: &str, now: MonotonicTime) -> Result<Isometry3<f64>, Fault> {
        let kinematics = Kinematics::new(self.topology)?;
        let link = kinematics.link(link).ok_or_else(|| Fault::permanent(format!("there is no link `{link}`")))?;
        let mut vectors = JointVectors::new(self.topology, &kinematics);
        vectors.set(|joint| self.joint_at(joint, now).point);
        let mut frames = Frames::new(kinematics);
        frames.update(&vectors.positions)?;
        Ok(self.root_at(now).0 * frames.root_from_link(link)?)
    }

    /// Moves the root link from `now` on: `motion` gives its pose, `world_from_root`, for the seconds since then. It must be
    /// smooth, is also asked for times a hundredth of a second before, and must not call this world, which waits for it.
    pub fn move_root(&self, now: MonotonicTime, motion: impl Fn(f64) -> Isometry3<f64> + Send + Sync + 'static) {
        self.advanced(0, now).change(now, |state| state.root = RootMotion::new(now, Arc::new(motion)));
    }

    /// Changes gravity from `now` on, m/s², in the world: zero in space. (0, 0, −[`GRAVITY`]) at the start.
    pub fn set_gravity(&self, now: MonotonicTime, gravity: Vector3<f64>) {
        self.advanced(0, now).change(now, |state| state.gravity = gravity);
    }

    pub(super) fn gravity(&self) -> Vector3<f64> {
        self.lock().gravity
    }

    /// `world_from_root`, and the motion of the root.
    pub(super) fn root_at(&self, now: MonotonicTime) -> (Isometry3<f64>, LinkMotion) {
        let root = self.lock().root.clone();
        (root.pose(now), root.motion(now))
    }

    /// Puts obstacles at both sides of a joint from `now` on: it stays between these positions, rad or m. Infinite ones remove
    /// them.
    ///
    /// # Errors
    /// There is no such joint, or nothing moves it.
    pub fn obstruct(&self, name: &str, lower: f64, upper: f64, now: MonotonicTime) -> Result<(), Fault> {
        let joint = self.number(name)?;
        self.advanced(joint, now).change(now, |state| {
            let plant = state.plants.get_mut(joint).and_then(Option::as_mut);
            let plant =
                plant.ok_or_else(|| Fault::new(format!("no simulated actuator moves the joint `{name}`")))?;
            plant.obstruct(lower, upper, now);
            Ok(())
        })
    }

    /// Makes the simulated receiver of satellite navigation at `path` fail, or work again.
    pub fn set_gnss_fault(&self, path: &str, fault: GnssFault) {
        self.lock().gnss_faults.insert(path.to_owned(), fault);
    }

    pub(super) fn gnss_fault(&self, path: &str) -> GnssFault {
        self.lock().gnss_faults.get(path).copied().unwrap_or_default()
    }

    /// Makes the simulated wheels at `path` spin: they turn faster than the robot drives, by this speed in m/s; less than 0 if they
    /// slide. 0 ends it.
    pub fn set_slip(&self, path: &str, speed: f64) {
        self.lock().slips.insert(path.to_owned(), speed);
    }

    pub(super) fn slip(&self, path: &str) -> f64 {
        self.lock().slips.get(path).copied().unwrap_or(0.0)
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

    /// Checks that a sensor is plugged in.
    ///
    /// # Errors
    /// The sensor is unplugged.
    pub(super) fn check_plugged(&self, path: &str) -> Result<(), Fault> {
        if self.lock().unplugged.contains(path) {
            return Err(Fault::new("the device is unplugged"));
        }
        Ok(())
    }

    /// Sets the clock of the run, whose joints rest until its [`start`](Clock::start).
    pub(super) fn set_clock(&self, clock: &Clock) {
        self.lock().clock.get_or_insert_with(|| clock.clone());
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
        self.advanced(joint, now).change(now, |state| {
            if let Some(slot) = state.plants.get_mut(joint) {
                match slot {
                    Some(plant) => plant.drivetrain = drivetrain,
                    None => *slot = Some(Plant::new(drivetrain, position, now)),
                }
            }
        });
        Ok(joint)
    }

    /// Gives a motor a goal.
    pub(super) fn set_goal(&self, joint: usize, goal: Goal, now: MonotonicTime) {
        self.advanced(joint, now).change(now, |state| {
            if let Some(plant) = state.plants.get_mut(joint).and_then(Option::as_mut) {
                plant.set(goal, now);
            }
        });
    }

    /// The state of a motor, and whether it has reached the end of its goal by itself.
    pub(super) fn motor(&self, joint: usize, now: MonotonicTime) -> (PlantState, Goal) {
        let mut state = self.advanced(joint, now);
        let plant = state.plants.get_mut(joint).and_then(Option::as_mut);
        plant.map_or((PlantState::default(), Goal::Free), |plant| (plant.at(now), plant.goal.clone()))
    }

    fn number(&self, name: &str) -> Result<usize, Fault> {
        let number = self.topology.joints.iter().position(|joint| joint.name == name);
        number.ok_or_else(|| Fault::permanent(format!("there is no joint `{name}`")))
    }

    /// Integrates a joint up to `now`. After a long time without a query this takes many steps: other threads get the lock
    /// meanwhile.
    fn advanced(&self, joint: usize, now: MonotonicTime) -> MutexGuard<'_, State> {
        loop {
            let mut state = self.lock();
            if state.advance(joint, now, MOST_WORK) {
                return state;
            }
            drop(state);
            std::thread::yield_now();
        }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for SimulatedWorld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SimulatedWorld").finish_non_exhaustive()
    }
}
