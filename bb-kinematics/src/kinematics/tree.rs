//! All links at once.

use super::KinematicsError;
use super::coordinates::Rate;
use super::mass::{Mass, own_masses};
use super::model::{Kinematics, LinkId};
use nalgebra::{Isometry3, Vector3};

/// The poses and motions of all links, at one state of the joints. Create it once; updates allocate nothing.
#[derive(Clone, Debug)]
pub struct Frames {
    kinematics: Kinematics,
    /// The motion of the root.
    root: LinkMotion,
    pub(super) states: Vec<State>,
    /// The mass of each body with everything it carries, for [`Self::gravity_efforts`].
    pub(super) masses: Vec<Mass>,
    /// The mass of the links fixed to the root, and of each body, without its children.
    pub(super) own_masses: Vec<Mass>,
}

/// The state of a body: its pose relative to the root, and its motion; vectors in its own axes, at its origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) root_from_body: Isometry3<f64>,
    pub(super) motion: LinkMotion,
}

/// The motion of a link: that of its origin, in the axes of the link. It is relative to the root, or to the frame in which
/// [`Frames::set_root_motion`] gives that of the root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkMotion {
    /// Linear velocity, m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
    /// The second derivative of the origin's position, m/s².
    pub acceleration: Vector3<f64>,
    /// Angular acceleration, rad/s².
    pub angular_acceleration: Vector3<f64>,
}

impl LinkMotion {
    /// A link at rest.
    pub const REST: Self = {
        let zero = Vector3::new(0.0, 0.0, 0.0);
        Self { velocity: zero, angular_velocity: zero, acceleration: zero, angular_acceleration: zero }
    };

    /// The motion of a frame fixed to this one: `frame_from_fixed`.
    pub fn at(&self, frame_from_fixed: &Isometry3<f64>) -> Self {
        let (omega, alpha) = (&self.angular_velocity, &self.angular_acceleration);
        let lever = &frame_from_fixed.translation.vector;
        let turn = frame_from_fixed.rotation.inverse();
        Self {
            velocity: turn * (self.velocity + omega.cross(lever)),
            angular_velocity: turn * omega,
            acceleration: turn * (self.acceleration + alpha.cross(lever) + omega.cross(&omega.cross(lever))),
            angular_acceleration: turn * alpha,
        }
    }

    /// The motion of the child, which its joint moves with this velocity and derivative, in the axes of the child.
    /// `self` is the motion of the parent at the child's origin, in the axes of the child.
    fn after(&self, rate: &Rate, derivative: &Rate) -> Self {
        let omega = &self.angular_velocity;
        Self {
            velocity: self.velocity + rate.linear,
            angular_velocity: omega + rate.angular,
            // Coriolis terms, and the rotation of the axes in which the relative velocity is given.
            acceleration: self.acceleration
                + omega.cross(&rate.linear) * 2.0
                + derivative.linear
                + rate.angular.cross(&rate.linear),
            angular_acceleration: self.angular_acceleration + omega.cross(&rate.angular) + derivative.angular,
        }
    }
}

impl Frames {
    /// Creates the frames at [`Kinematics::neutral`].
    pub fn new(kinematics: Kinematics) -> Self {
        let at_rest = State { root_from_body: Isometry3::identity(), motion: LinkMotion::REST };
        let own_masses = own_masses(&kinematics);
        let bodies = kinematics.bodies.len();
        let neutral = kinematics.neutral();
        let mut frames = Self {
            root: LinkMotion::REST,
            states: vec![at_rest; bodies],
            masses: own_masses.clone(),
            own_masses,
            kinematics,
        };
        frames.place(&neutral);
        frames
    }

    /// The robot with these frames.
    pub fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// Sets the motion of the root link in an inertial frame, in the axes of the root: of a robot that drives or flies. At
    /// rest if this is not called. Applies to the motions of the following [`Self::update_motion`].
    pub fn set_root_motion(&mut self, motion: LinkMotion) {
        self.root = motion;
    }

    /// Sets the position of the robot, all of it at rest.
    ///
    /// # Errors
    /// The number of positions is not that of the robot.
    pub fn update(&mut self, positions: &[f64]) -> Result<(), KinematicsError> {
        self.kinematics.check_positions(positions)?;
        self.place(positions);
        self.root = LinkMotion::REST;
        self.states.iter_mut().for_each(|state| state.motion = LinkMotion::REST);
        Ok(())
    }

    /// Sets the position and motion of the robot; `accelerations` are the derivatives of the velocities.
    ///
    /// # Errors
    /// The number of positions, velocities or accelerations is not that of the robot.
    pub fn update_motion(
        &mut self,
        positions: &[f64],
        velocities: &[f64],
        accelerations: &[f64],
    ) -> Result<(), KinematicsError> {
        self.kinematics.check_positions(positions)?;
        self.kinematics.check_velocities("velocities", velocities)?;
        self.kinematics.check_velocities("accelerations", accelerations)?;
        self.place(positions);
        for (index, body) in self.kinematics.bodies.iter().enumerate() {
            let parent = body.parent.map_or(self.root, |parent| self.states[parent].motion);
            let joint_from_body = body.motion.carry(positions, &Isometry3::identity());
            let carried = parent.at(&(body.parent_from_joint * joint_from_body));
            self.states[index].motion =
                carried.after(&body.motion.rate(velocities), &body.motion.rate(accelerations));
        }
        Ok(())
    }

    fn place(&mut self, positions: &[f64]) {
        for (index, body) in self.kinematics.bodies.iter().enumerate() {
            let parent_from_body = body.parent_from_joint * body.motion.carry(positions, &Isometry3::identity());
            self.states[index].root_from_body = match body.parent {
                Some(parent) => self.states[parent].root_from_body * parent_from_body,
                None => parent_from_body,
            };
        }
    }

    /// `parent_from_body`, or `root_from_body` if its parent is the root.
    pub(super) fn parent_from_body(&self, body: usize) -> Isometry3<f64> {
        let root_from_body = &self.states[body].root_from_body;
        let parent = self.kinematics.bodies[body].parent;
        parent.map_or(*root_from_body, |parent| self.states[parent].root_from_body.inv_mul(root_from_body))
    }

    /// `root_from_link`.
    ///
    /// # Errors
    /// The link does not belong to this robot.
    pub fn root_from_link(&self, link: LinkId) -> Result<Isometry3<f64>, KinematicsError> {
        let placement = self.kinematics.placement(link)?;
        let body_from_link = &placement.body_from_link;
        Ok(placement.body.map_or(*body_from_link, |body| self.states[body].root_from_body * body_from_link))
    }

    /// `base_from_tip`, for any two links.
    ///
    /// # Errors
    /// A link does not belong to this robot.
    pub fn transform(&self, base: LinkId, tip: LinkId) -> Result<Isometry3<f64>, KinematicsError> {
        Ok(self.root_from_link(base)?.inv_mul(&self.root_from_link(tip)?))
    }

    /// The motion of a link.
    ///
    /// # Errors
    /// The link does not belong to this robot.
    pub fn motion(&self, link: LinkId) -> Result<LinkMotion, KinematicsError> {
        let placement = self.kinematics.placement(link)?;
        let motion = placement.body.map_or(self.root, |body| self.states[body].motion);
        Ok(motion.at(&placement.body_from_link))
    }
}
