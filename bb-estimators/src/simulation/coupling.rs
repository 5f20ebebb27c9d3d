//! Effects of a robot's links on its joints: gravity, their inertia, and the motion of the other joints.

use super::plant::{Load, Plant, STEP_S};
use super::root::RootMotion;
use crate::motion::JointPoint;
use bb_core::MonotonicTime;
use bb_core::kinematics::{Dynamics, Kinematics};
use bb_core::topology::Topology;
use nalgebra::{DMatrix, Vector3};
use std::time::Duration;

/// The coordinates of the joints with one degree of freedom, as the kinematics takes them. Other joints rest at zero.
#[derive(Clone, Debug)]
pub(super) struct JointVectors {
    /// Number in the topology, index of its position, index of its velocity.
    joints: Vec<(usize, usize, usize)>,
    pub(super) positions: Vec<f64>,
    pub(super) velocities: Vec<f64>,
    pub(super) accelerations: Vec<f64>,
}

impl JointVectors {
    pub(super) fn new(topology: &Topology, kinematics: &Kinematics) -> Self {
        let single = topology.joints.iter().enumerate().filter_map(|(number, joint)| {
            let own = kinematics.joint(joint.name)?;
            // A joint that mimics another has that joint's.
            (joint.mimic.is_none() && own.positions.len() == 1).then_some((
                number,
                own.positions.start,
                own.velocities.start,
            ))
        });
        Self {
            joints: single.collect(),
            positions: kinematics.neutral(),
            velocities: vec![0.0; kinematics.velocities()],
            accelerations: vec![0.0; kinematics.velocities()],
        }
    }

    /// Sets the state of each joint by its number in the topology.
    pub(super) fn set(&mut self, mut point: impl FnMut(usize) -> JointPoint) {
        for (number, position, velocity) in &self.joints {
            let point = point(*number);
            self.positions[*position] = point.position;
            self.velocities[*velocity] = point.velocity;
            self.accelerations[*velocity] = point.acceleration;
        }
    }
}

/// The dynamics of a robot whose moving links declare their `inertial`.
#[derive(Clone, Debug)]
pub(super) struct Coupling {
    dynamics: Dynamics,
    vectors: JointVectors,
    masses: DMatrix<f64>,
    bias: Vec<f64>,
    accelerations: Vec<f64>,
    sweeps: u64,
}

/// The accelerations of a step are found by this many sweeps at most, each joint in turn. For a positive definite mass matrix, also
/// with the limits of motors and with friction, sweeps converge, but slowly for a chain of many parallel joints without servos whose
/// motors have little inertia: six with 0.01 kg m² each are still off by 4e-4 of the largest.
const SWEEPS: u32 = 1_000;

/// Number of sweeps after which a joint that comes to an end of its range in one of them does so in all that follow.
const UNDECIDED: u32 = 50;

/// The change of the accelerations in a sweep that ends the search, relative to the largest, or rad/s² or m/s².
const CONVERGED: f64 = 1e-13;

impl Coupling {
    /// `None` if no link that moves has a mass.
    pub(super) fn new(topology: &Topology) -> Option<Self> {
        let kinematics = Kinematics::new(topology).ok()?;
        let vectors = JointVectors::new(topology, &kinematics);
        let size = kinematics.velocities();
        let mut dynamics = Dynamics::new(kinematics);
        let mut masses = DMatrix::zeros(size, size);
        dynamics.mass_matrix(&mut masses).ok()?;
        let has_mass = masses.iter().any(|mass| *mass != 0.0);
        let (bias, accelerations) = (vec![0.0; size], vec![0.0; size]);
        has_mass.then_some(Self { dynamics, vectors, masses, bias, accelerations, sweeps: 0 })
    }

    /// Returns the number of sweeps over the joints in all steps together; a step takes one at least.
    pub(super) fn sweeps(&self) -> u64 {
        self.sweeps
    }

    /// Sets the load of each joint for the step that begins at `now`.
    ///
    /// Positions and velocities are those in the middle of the step, by the accelerations of the step before: the error of
    /// the integration is then of second order.
    pub(super) fn load(
        &mut self,
        plants: &mut [Option<Plant>],
        root: &RootMotion,
        gravity: &Vector3<f64>,
        now: MonotonicTime,
    ) {
        let half_s = 0.5 * STEP_S;
        self.vectors.set(|joint| {
            let point = plants
                .get(joint)
                .and_then(Option::as_ref)
                .map_or_else(Default::default, |plant| plant.state().point);
            JointPoint {
                position: point.position + half_s * (point.velocity + 0.5 * half_s * point.acceleration),
                velocity: point.velocity + half_s * point.acceleration,
                acceleration: 0.0,
            }
        });
        let middle = now + Duration::from_secs_f64(half_s);
        let root_from_world = root.pose(middle).rotation.inverse();
        let JointVectors { positions, velocities, accelerations, .. } = &self.vectors;
        let frames = self.dynamics.frames_mut();
        frames.set_root_motion(root.motion(middle));
        // The vectors were made for this robot.
        let updated = frames.update_motion(positions, velocities, accelerations).is_ok()
            && self.dynamics.efforts(&(root_from_world * gravity), &mut self.bias).is_ok()
            && self.dynamics.mass_matrix(&mut self.masses).is_ok();
        // A root that is nowhere, by the function that moves it, loads no joint; a joint could not forget a NaN.
        if updated && self.bias.iter().all(|effort| effort.is_finite()) {
            self.solve(plants);
        } else {
            self.sweeps += 1;
        }
    }

    /// Finds accelerations and loads that agree: the projected Gauss–Seidel method.
    fn solve(&mut self, plants: &mut [Option<Plant>]) {
        let Self { vectors, masses, bias, accelerations, sweeps, .. } = self;
        accelerations.fill(0.0);
        for (joint, _, velocity) in &vectors.joints {
            if let Some(plant) = plants.get(*joint).and_then(Option::as_ref) {
                accelerations[*velocity] = plant.state().point.acceleration;
            }
        }
        for sweep in 0..SWEEPS {
            *sweeps += 1;
            let (mut change, mut largest) = (0.0_f64, 1.0_f64);
            for (joint, _, velocity) in &vectors.joints {
                let (velocity, Some(plant)) = (*velocity, plants.get_mut(*joint).and_then(Option::as_mut)) else {
                    continue;
                };
                let inertia = masses[(velocity, velocity)];
                let all: f64 =
                    masses.column(velocity).iter().zip(accelerations.iter()).map(|(mass, a)| mass * a).sum();
                plant.load = Load { inertia, effort: bias[velocity] + all - inertia * accelerations[velocity] };
                if sweep >= UNDECIDED {
                    plant.decide();
                }
                let acceleration = plant.mean_acceleration();
                change = change.max((acceleration - accelerations[velocity]).abs());
                largest = largest.max(acceleration.abs());
                accelerations[velocity] = acceleration;
            }
            if change <= CONVERGED * largest {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests;
