//! Chains of joints from one link to another.

use super::KinematicsError;
use super::coordinates::{Motion, Rate};
use super::model::{Kinematics, LinkId, check};
use nalgebra::{Dim, Isometry3, Matrix, RawStorageMut, U6, Vector3, Vector6};

/// The joints between two links, precomputed: fixed joints are multiplied out, so a chain without moving joints is a
/// constant.
#[derive(Clone, Debug)]
pub struct Chain {
    /// Steps from the last common ancestor towards the tip.
    to_tip: Box<[Step]>,
    /// Steps from the last common ancestor towards the base.
    to_base: Box<[Step]>,
    body_from_tip: Isometry3<f64>,
    base_from_body: Isometry3<f64>,
    positions: usize,
    velocities: usize,
}

#[derive(Clone, Copy, Debug)]
struct Step {
    parent_from_joint: Isometry3<f64>,
    joint_from_parent: Isometry3<f64>,
    motion: Motion,
}

impl Kinematics {
    /// The chain from `base` to `tip`, any two links.
    ///
    /// # Errors
    /// A link does not belong to this robot.
    pub fn chain(&self, base: LinkId, tip: LinkId) -> Result<Chain, KinematicsError> {
        let (base, tip) = (self.placement(base)?, self.placement(tip)?);
        let (mut of_base, mut of_tip) = (self.ancestors(base.body), self.ancestors(tip.body));
        // Common ancestors move neither link in the frame of the other.
        while of_base.last().is_some() && of_base.last() == of_tip.last() {
            of_base.pop();
            of_tip.pop();
        }
        let steps = |bodies: Vec<usize>| -> Box<[Step]> {
            let bodies = bodies.into_iter().rev().filter_map(|body| self.bodies.get(body));
            bodies
                .map(|body| Step {
                    parent_from_joint: body.parent_from_joint,
                    joint_from_parent: body.joint_from_parent,
                    motion: body.motion,
                })
                .collect()
        };
        let (mut to_tip, mut to_base) = (steps(of_tip), steps(of_base));
        let mut body_from_tip = tip.body_from_link;
        let mut base_from_body = base.body_from_link.inverse();
        // If one side has no joints, its constant is folded into the other side's first.
        if to_base.is_empty() {
            match to_tip.first_mut() {
                Some(first) => {
                    first.parent_from_joint = base_from_body * first.parent_from_joint;
                    first.joint_from_parent = first.parent_from_joint.inverse();
                }
                None => body_from_tip = base_from_body * body_from_tip,
            }
            base_from_body = Isometry3::identity();
        } else if to_tip.is_empty()
            && let Some(first) = to_base.first_mut()
        {
            first.joint_from_parent *= body_from_tip;
            first.parent_from_joint = first.joint_from_parent.inverse();
            body_from_tip = Isometry3::identity();
        }
        let (positions, velocities) = (self.positions(), self.velocities());
        Ok(Chain { to_tip, to_base, body_from_tip, base_from_body, positions, velocities })
    }

    /// A body and its ancestors, up to the root.
    fn ancestors(&self, body: Option<usize>) -> Vec<usize> {
        std::iter::successors(body, |body| self.bodies.get(*body).and_then(|body| body.parent)).collect()
    }
}

impl Chain {
    /// `base_from_tip` at a position.
    ///
    /// # Errors
    /// The number of positions is not that of the robot.
    pub fn transform(&self, positions: &[f64]) -> Result<Isometry3<f64>, KinematicsError> {
        check("positions", self.positions, positions)?;
        Ok(self.at(positions))
    }

    /// Returns the same as [`Self::transform`], with the number of positions unchecked.
    #[inline]
    #[doc(hidden)]
    pub fn at(&self, positions: &[f64]) -> Isometry3<f64> {
        let mut from_tip = self.body_from_tip;
        for step in self.to_tip.iter().rev() {
            from_tip = step.parent_from_joint * step.motion.carry(positions, &from_tip);
        }
        if self.to_base.is_empty() {
            return from_tip;
        }
        for step in &self.to_base {
            from_tip = step.motion.carry_back(positions, &(step.joint_from_parent * from_tip));
        }
        self.base_from_body * from_tip
    }

    /// `base_from_tip`. `jacobian` is set to the velocity of the tip relative to the base per unit of each velocity,
    /// in the axes of the base. Rows 1–3 are the velocity of the tip's origin, m/s; rows 4–6 the angular velocity,
    /// rad/s. There is one column per velocity of the robot; those that do not move the chain are zero.
    ///
    /// # Errors
    /// The number of positions, or of columns, is not that of the robot.
    pub fn jacobian<C: Dim, S: RawStorageMut<f64, U6, C>>(
        &self,
        positions: &[f64],
        jacobian: &mut Matrix<f64, U6, C, S>,
    ) -> Result<Isometry3<f64>, KinematicsError> {
        check("positions", self.positions, positions)?;
        let (expected, given) = (self.velocities, jacobian.ncols());
        if expected != given {
            return Err(KinematicsError::Coordinates { what: "columns", expected, given });
        }
        jacobian.fill(0.0);
        // In the axes of the tip, which both sides have.
        let mut from_tip = self.body_from_tip;
        for step in self.to_tip.iter().rev() {
            add_columns(&step.motion, &from_tip, 1.0, jacobian);
            from_tip = step.parent_from_joint * step.motion.carry(positions, &from_tip);
        }
        for step in &self.to_base {
            from_tip = step.motion.carry_back(positions, &(step.joint_from_parent * from_tip));
            // A motion of the base moves the tip in the opposite direction, seen from the base.
            add_columns(&step.motion, &from_tip, -1.0, jacobian);
        }
        let base_from_tip = self.base_from_body * from_tip;
        let rotation = base_from_tip.rotation.to_rotation_matrix();
        for mut column in jacobian.column_iter_mut() {
            let linear = rotation * Vector3::new(column[0], column[1], column[2]);
            let angular = rotation * Vector3::new(column[3], column[4], column[5]);
            column.copy_from(&Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z));
        }
        Ok(base_from_tip)
    }

    /// The number of moving joints between the two links.
    pub fn joints(&self) -> usize {
        self.to_tip.len() + self.to_base.len()
    }

    /// Returns the chain between frames fixed to the two links: it transforms points from the one on the tip to the one on the base.
    #[doc(hidden)]
    pub fn between(mut self, base_from_frame: &Isometry3<f64>, tip_from_frame: &Isometry3<f64>) -> Self {
        let frame_from_base = base_from_frame.inverse();
        self.body_from_tip *= tip_from_frame;
        match self.to_tip.first_mut() {
            Some(first) if self.to_base.is_empty() => {
                first.parent_from_joint = frame_from_base * first.parent_from_joint;
                first.joint_from_parent = first.parent_from_joint.inverse();
            }
            None if self.to_base.is_empty() => self.body_from_tip = frame_from_base * self.body_from_tip,
            _ => self.base_from_body = frame_from_base * self.base_from_body,
        }
        self
    }

    /// Renumbers its positions by `renumber`, from those of the robot to `positions` of its own.
    #[doc(hidden)]
    pub fn renumbered(mut self, positions: usize, renumber: impl Fn(usize) -> usize) -> Self {
        for step in self.to_tip.iter_mut().chain(&mut self.to_base) {
            step.motion.renumber(&renumber);
        }
        self.positions = positions;
        self
    }

    /// Returns whether a velocity of the robot moves the chain.
    #[doc(hidden)]
    pub fn has(&self, velocity: usize) -> bool {
        let mut has = false;
        for step in self.to_tip.iter().chain(&self.to_base) {
            step.motion.each_velocity(|moved, _| has |= moved == velocity);
        }
        has
    }
}

/// Adds the effect of a joint on the tip, in the axes of the tip.
#[inline]
fn add_columns<C: Dim, S: RawStorageMut<f64, U6, C>>(
    motion: &Motion,
    child_from_tip: &Isometry3<f64>,
    sign: f64,
    jacobian: &mut Matrix<f64, U6, C, S>,
) {
    let tip_from_child = child_from_tip.rotation.inverse();
    let tip = &child_from_tip.translation.vector;
    motion.each_velocity(|velocity, Rate { linear, angular }| {
        let linear = tip_from_child * ((linear + angular.cross(tip)) * sign);
        let angular = tip_from_child * (angular * sign);
        let mut column = jacobian.column_mut(velocity);
        column[0] += linear.x;
        column[1] += linear.y;
        column[2] += linear.z;
        column[3] += angular.x;
        column[4] += angular.y;
        column[5] += angular.z;
    });
}
