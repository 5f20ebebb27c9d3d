//! Inverse kinematics: joint positions that bring a link to a target.
//!
//! Damped least squares with the damping of Chan and Lawrence (1988), proportional to the squared error: `δ = W⁻¹ Jᵀ
//! (J W⁻¹ Jᵀ + λ I)⁻¹ e`. The matrix is 6×6 for any number of joints. A joint that would leave its limits is held
//! there, and the step is computed again without it. An attempt without progress is abandoned and restarted from a
//! random position; the random numbers are the same in each call.

use super::coordinates::Owner;
use super::model::{Kinematics, LinkId};
use super::{Chain, KinematicsError};
use crate::topology::JointKind;
use nalgebra::{Isometry3, Matrix6, Matrix6xX, UnitQuaternion, Vector3, Vector6};
use std::f64::consts::PI;

/// The target of a link, in the frame of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// `base_from_tip`.
    Pose(Isometry3<f64>),
    /// The origin of the tip, m; its orientation is free.
    Position(Vector3<f64>),
}

/// Settings of the search for a solution.
#[derive(Clone, Debug, PartialEq)]
pub struct InverseParams {
    /// The largest error of a solution, m. 1 µm by default.
    pub position_tolerance: f64,
    /// The largest error of a solution, rad. 1 µrad by default.
    pub rotation_tolerance: f64,
    /// Iterations in all, restarts included. 3,000 by default, some milliseconds for an arm.
    pub max_iterations: u32,
    /// The cost of a unit of each velocity: joints with a larger weight move less. Empty, the default, means equal
    /// weights.
    pub weights: Vec<f64>,
    /// A preferred position, approached as far as the target leaves freedom; it has the length of a position. Empty,
    /// the default, for none.
    pub posture: Vec<f64>,
}

impl Default for InverseParams {
    fn default() -> Self {
        Self {
            position_tolerance: 1e-6,
            rotation_tolerance: 1e-6,
            max_iterations: 3_000,
            weights: Vec::new(),
            posture: Vec::new(),
        }
    }
}

/// A position that reaches the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution<'a> {
    /// The position of all joints; those that do not move the chain are unchanged.
    pub positions: &'a [f64],
    /// Position error, m.
    pub position_error: f64,
    /// Rotation error, rad; 0 if only a position was asked for.
    pub rotation_error: f64,
    /// The total number of iterations.
    pub iterations: u32,
    /// Number of restarts from a random position.
    pub restarts: u32,
}

/// Solves for one chain. Create it once; solving allocates nothing.
#[derive(Clone, Debug)]
pub struct InverseKinematics {
    chain: Chain,
    params: InverseParams,
    owners: Vec<Owner>,
    /// Position and bounds of each velocity that is a coordinate with limits.
    limits: Vec<Option<(usize, f64, f64)>>,
    /// The reciprocal weight of each velocity, 0 for those that do not move the chain.
    mobility: Vec<f64>,
    jacobian: Matrix6xX<f64>,
    /// Jacobian of the joints that are not held at a limit, times their mobility.
    free: Matrix6xX<f64>,
    held: Vec<bool>,
    step: Vec<f64>,
    positions: Vec<f64>,
    best: Vec<f64>,
}

/// An attempt that does not halve its error in this many iterations is abandoned.
const PATIENCE: u32 = 8;

/// The longest step of a joint in one iteration, rad or m.
const LONGEST_STEP: f64 = 0.7;

/// Number of iterations that move the redundant joints towards the posture once the target is reached.
const POLISH: u32 = 60;

/// Position and rotation error, and both as one vector.
struct Error {
    position: f64,
    rotation: f64,
    vector: Vector6<f64>,
}

impl InverseKinematics {
    /// Creates a solver for the chain from `base` to `tip`.
    ///
    /// # Errors
    /// A link does not belong to this robot; weights or a posture of another length or not finite; or a weight that
    /// is not positive.
    pub fn new(
        kinematics: &Kinematics,
        base: LinkId,
        tip: LinkId,
        params: InverseParams,
    ) -> Result<Self, KinematicsError> {
        let chain = kinematics.chain(base, tip)?;
        let velocities = kinematics.velocities();
        if !params.weights.is_empty() {
            kinematics.check_velocities("weights", &params.weights)?;
        }
        if params.weights.iter().any(|weight| !(weight.is_finite() && *weight > 0.0)) {
            return Err(KinematicsError::NotFinite { what: "reciprocal of a weight" });
        }
        if !params.posture.is_empty() {
            kinematics.check_positions(&params.posture)?;
            finite("posture", &params.posture)?;
        }
        let owners: Vec<Owner> =
            kinematics.owners().iter().filter(|owner| chain.has(owner.velocity)).copied().collect();
        let mut limits = vec![None; velocities];
        for owner in &owners {
            let bounds = kinematics.bounds().get(owner.position).copied();
            if let (1, Some((lower, upper)), Some(limit)) =
                (owner.velocities(), bounds, limits.get_mut(owner.velocity))
            {
                *limit = Some((owner.position, lower, upper));
            }
        }
        let weight = |velocity: usize| params.weights.get(velocity).copied().unwrap_or(1.0);
        let mobility = (0..velocities).map(|v| if chain.has(v) { 1.0 / weight(v) } else { 0.0 }).collect();
        let neutral = kinematics.neutral();
        Ok(Self {
            chain,
            params,
            owners,
            limits,
            mobility,
            jacobian: Matrix6xX::zeros(velocities),
            free: Matrix6xX::zeros(velocities),
            held: vec![false; velocities],
            step: vec![0.0; velocities],
            positions: neutral.clone(),
            best: neutral,
        })
    }

    /// The best position of the last call, even if it did not converge.
    pub fn best(&self) -> &[f64] {
        &self.best
    }

    /// Searches for a position that reaches the target, beginning at `start`. The solution is near `start` if the
    /// target is.
    ///
    /// # Errors
    /// [`KinematicsError::NotConverged`] with the error of the best position, [`Self::best`]; a start of another
    /// length; or a start or a target that is not finite.
    pub fn solve(&mut self, target: &Target, start: &[f64]) -> Result<Solution<'_>, KinematicsError> {
        super::model::check("positions", self.positions.len(), start)?;
        finite("start", start)?;
        let is_finite = match target {
            Target::Pose(pose) => {
                let is_rotation = (pose.rotation.coords.norm() - 1.0).abs() < 1e-6;
                is_rotation && pose.translation.vector.iter().all(|part| part.is_finite())
            }
            Target::Position(position) => position.iter().all(|part| part.is_finite()),
        };
        if !is_finite {
            return Err(KinematicsError::NotFinite { what: "target" });
        }
        self.positions.copy_from_slice(start);
        self.clamp();
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let (mut iterations, mut restarts) = (0, 0);
        let (mut best, mut best_cost, mut has_reached) = (None, f64::INFINITY, false);
        let (mut reference, mut since, mut polished) = (f64::INFINITY, 0, 0);
        loop {
            let error = self.error(target)?;
            let cost = 0.5 * error.vector.norm_squared();
            let is_reached = error.position <= self.params.position_tolerance
                && error.rotation <= self.params.rotation_tolerance;
            if is_reached || (!has_reached && cost < best_cost) {
                has_reached |= is_reached;
                best_cost = cost;
                self.best.copy_from_slice(&self.positions);
                best = Some((error.position, error.rotation));
            }
            let is_polishing =
                !self.params.posture.is_empty() && polished < POLISH && iterations < self.params.max_iterations;
            if has_reached && !is_polishing {
                // A step towards the posture may have left the target: the last position that reached it counts.
                let (position_error, rotation_error) = best.unwrap_or((error.position, error.rotation));
                return Ok(Solution {
                    positions: &self.best,
                    position_error,
                    rotation_error,
                    iterations,
                    restarts,
                });
            }
            if iterations >= self.params.max_iterations {
                let (position_error, rotation_error) = best.unwrap_or((f64::NAN, f64::NAN));
                return Err(KinematicsError::NotConverged { position_error, rotation_error, iterations });
            }
            iterations += 1;
            polished += u32::from(has_reached);
            if cost < 0.25 * reference {
                (reference, since) = (cost, 0);
            } else {
                since += 1;
            }
            if since > PATIENCE && !has_reached {
                restarts += 1;
                (reference, since) = (f64::INFINITY, 0);
                self.scatter(&mut random);
                continue;
            }
            let length = self.compute_step(&error.vector, cost, matches!(target, Target::Position(_)));
            if polished > 0 && length < 1e-9 {
                polished = POLISH;
            }
            let scale = if length > LONGEST_STEP { LONGEST_STEP / length } else { 1.0 };
            self.step.iter_mut().for_each(|part| *part *= scale);
            for owner in &self.owners {
                owner.integrate(&mut self.positions, &self.step, 1.0);
            }
            self.clamp();
        }
    }

    /// Computes the error of the tip, in the axes of the base, and the Jacobian.
    fn error(&mut self, target: &Target) -> Result<Error, KinematicsError> {
        let base_from_tip = self.chain.jacobian(&self.positions, &mut self.jacobian)?;
        let tip = base_from_tip.translation.vector;
        let (linear, angular) = match target {
            Target::Pose(pose) => {
                (pose.translation.vector - tip, rotation_between(&base_from_tip.rotation, &pose.rotation))
            }
            Target::Position(position) => (position - tip, Vector3::zeros()),
        };
        let vector = Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z);
        Ok(Error { position: linear.norm(), rotation: angular.norm(), vector })
    }

    /// Computes the step; returns the largest change of a joint.
    fn compute_step(&mut self, error: &Vector6<f64>, cost: f64, position_only: bool) -> f64 {
        self.held.fill(false);
        let mut error = *error;
        if position_only {
            // Rows without a target.
            self.jacobian.fixed_rows_mut::<3>(3).fill(0.0);
            error.fixed_rows_mut::<3>(3).fill(0.0);
        }
        loop {
            for (index, mut column) in self.free.column_iter_mut().enumerate() {
                let mobility = if self.held[index] { 0.0 } else { self.mobility[index] };
                column.copy_from(&(self.jacobian.column(index) * mobility));
            }
            let mut normal = Matrix6::zeros();
            for (weighted, column) in self.free.column_iter().zip(self.jacobian.column_iter()) {
                normal.ger(1.0, &weighted, &column, 1.0);
            }
            // Without the last term, the step would be undefined at a singular position.
            let damping = cost + 1e-12;
            for diagonal in 0..6 {
                normal[(diagonal, diagonal)] += damping;
            }
            let Some(factor) = normal.cholesky() else {
                self.step.fill(0.0);
                return 0.0;
            };
            let multipliers = factor.solve(&error);
            for (part, weighted) in self.step.iter_mut().zip(self.free.column_iter()) {
                *part = weighted.dot(&multipliers);
            }
            self.add_posture(&factor);
            if !self.hold() {
                break;
            }
        }
        self.step.iter().fold(0.0, |longest: f64, part| longest.max(part.abs()))
    }

    /// Adds a motion towards the posture that does not move the tip.
    fn add_posture(&mut self, factor: &nalgebra::Cholesky<f64, nalgebra::U6>) {
        if self.params.posture.is_empty() {
            return;
        }
        let mut wanted = Vector6::zeros();
        let towards = |limits: &[Option<(usize, f64, f64)>], index: usize, positions: &[f64], posture: &[f64]| {
            limits[index].map_or(0.0, |(position, _, _)| 0.3 * (posture[position] - positions[position]))
        };
        for index in 0..self.step.len() {
            if !self.held[index] && self.mobility[index] > 0.0 {
                let part = towards(&self.limits, index, &self.positions, &self.params.posture);
                wanted += self.jacobian.column(index) * part;
            }
        }
        let back = factor.solve(&wanted);
        for index in 0..self.step.len() {
            if !self.held[index] && self.mobility[index] > 0.0 {
                let part = towards(&self.limits, index, &self.positions, &self.params.posture);
                self.step[index] += part - self.free.column(index).dot(&back);
            }
        }
    }

    /// Holds joints that are at a limit and would leave it; returns whether there is another one.
    fn hold(&mut self) -> bool {
        let mut is_new = false;
        for (index, limit) in self.limits.iter().enumerate() {
            let Some((position, lower, upper)) = *limit else { continue };
            let (now, step) = (self.positions[position], self.step[index]);
            if !self.held[index] && ((now <= lower && step < 0.0) || (now >= upper && step > 0.0)) {
                self.held[index] = true;
                is_new = true;
            }
        }
        is_new
    }

    fn clamp(&mut self) {
        for (position, lower, upper) in self.limits.iter().flatten() {
            // Not `clamp`, which panics if limits leave nothing.
            self.positions[*position] = self.positions[*position].min(*upper).max(*lower);
        }
    }

    /// Restarts at a random position within the limits.
    fn scatter(&mut self, random: &mut Random) {
        for owner in &self.owners {
            match owner.kind {
                JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic => {
                    let limit = self.limits.get(owner.velocity).copied().flatten();
                    let reach = if owner.kind == JointKind::Prismatic { 1.0 } else { PI };
                    let (lower, upper) = limit.map_or((-reach, reach), |(_, lower, upper)| {
                        // Turning a wrist by full turns gives the same pose.
                        let centre = match (lower.is_finite(), upper.is_finite()) {
                            (true, true) => 0.5 * (lower + upper),
                            (true, false) => lower + reach,
                            (false, true) => upper - reach,
                            (false, false) => 0.0,
                        };
                        (lower.max(centre - reach), upper.min(centre + reach))
                    });
                    self.positions[owner.position] = lower + (upper - lower) * random.next();
                }
                // The best position so far, with a random heading.
                JointKind::Planar => self.positions[owner.position + 2] = PI * (2.0 * random.next() - 1.0),
                JointKind::Fixed | JointKind::Floating => {}
            }
        }
    }
}

/// The rotation vector, in the frame of both, that takes `from` to `to`.
fn rotation_between(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Vector3<f64> {
    (to * from.inverse()).scaled_axis()
}

fn finite(what: &'static str, numbers: &[f64]) -> Result<(), KinematicsError> {
    if numbers.iter().all(|number| number.is_finite()) { Ok(()) } else { Err(KinematicsError::NotFinite { what }) }
}

/// SplitMix64 (Steele, Lea and Flood, 2014).
struct Random(u64);

impl Random {
    /// Returns a number from 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as f64 / u64::MAX as f64
    }
}
