//! Dynamics: the efforts of a motion, and the mass matrix.
//!
//! Both are the recursions of Featherstone, *Rigid Body Dynamics Algorithms*, 2008: the recursive Newton–Euler algorithm
//! (chapter 5) and the composite-rigid-body algorithm (chapter 6).

use super::coordinates::Rate;
use super::mass::RigidBody;
use super::model::check;
use super::tree::{Frames, LinkMotion};
use super::{Kinematics, KinematicsError};
use nalgebra::{DMatrix, Isometry3, Vector3};

/// A force on a body at its origin and a torque, in the axes of the body.
#[derive(Clone, Copy, Debug)]
struct Wrench {
    force: Vector3<f64>,
    torque: Vector3<f64>,
}

impl Wrench {
    const NONE: Self = Self { force: Vector3::new(0.0, 0.0, 0.0), torque: Vector3::new(0.0, 0.0, 0.0) };

    /// The rate of change of a body's momentum, for the acceleration of its origin without gravity.
    fn of(body: &RigidBody, motion: &LinkMotion, acceleration: &Vector3<f64>) -> Self {
        let (omega, alpha) = (&motion.angular_velocity, &motion.angular_acceleration);
        let RigidBody { mass, moment, inertia } = body;
        Self {
            force: acceleration * *mass + alpha.cross(moment) + omega.cross(&omega.cross(moment)),
            torque: moment.cross(acceleration) + inertia * alpha + omega.cross(&(inertia * omega)),
        }
    }

    /// The momentum of a body that moves at a rate: its force per unit of acceleration.
    fn of_rate(body: &RigidBody, rate: &Rate) -> Self {
        Self {
            force: rate.linear * body.mass + rate.angular.cross(&body.moment),
            torque: body.moment.cross(&rate.linear) + body.inertia * rate.angular,
        }
    }

    /// Returns the same wrench at the origin of the parent, in the axes of the parent.
    fn carried(&self, parent_from_body: &Isometry3<f64>) -> Self {
        let force = parent_from_body.rotation * self.force;
        let lever = &parent_from_body.translation.vector;
        Self { force, torque: parent_from_body.rotation * self.torque + lever.cross(&force) }
    }

    fn along(&self, rate: &Rate) -> f64 {
        self.force.dot(&rate.linear) + self.torque.dot(&rate.angular)
    }
}

/// The dynamics of a robot whose links declare their `inertial`. Create it once; its functions allocate nothing.
#[derive(Clone, Debug)]
pub struct Dynamics {
    frames: Frames,
    own: Vec<RigidBody>,
    /// Each body with everything it carries.
    composite: Vec<RigidBody>,
    wrenches: Vec<Wrench>,
}

impl Dynamics {
    /// Creates the dynamics of a robot.
    pub fn new(kinematics: Kinematics) -> Self {
        let own = super::mass::rigid_bodies(&kinematics);
        let wrenches = vec![Wrench::NONE; own.len()];
        Self { frames: Frames::new(kinematics), composite: own.clone(), own, wrenches }
    }

    /// The poses and motions of its links, which the other functions take from here.
    pub fn frames(&self) -> &Frames {
        &self.frames
    }

    /// Returns the poses and motions of the robot's links, to be updated.
    pub fn frames_mut(&mut self) -> &mut Frames {
        &mut self.frames
    }

    /// Inverse dynamics: the efforts that cause the motion of the last [`Frames::update_motion`], under a gravity in
    /// m/s² in the frame of the root: (0, 0, −9.8) if its z points up. One for each velocity: N·m for a rotation, N for a
    /// translation.
    ///
    /// With accelerations of zero, these are the efforts of gravity and of the velocities (Coriolis and centrifugal).
    ///
    /// # Errors
    /// The number of efforts is not that of the robot's velocities.
    pub fn efforts(&mut self, gravity: &Vector3<f64>, efforts: &mut [f64]) -> Result<(), KinematicsError> {
        check("efforts", self.frames.kinematics().velocities(), efforts)?;
        efforts.fill(0.0);
        for (number, wrench) in self.wrenches.iter_mut().enumerate() {
            let state = &self.frames.states[number];
            let acceleration = state.motion.acceleration - state.root_from_body.rotation.inverse() * gravity;
            *wrench = Wrench::of(&self.own[number], &state.motion, &acceleration);
        }
        for (number, body) in self.frames.kinematics().bodies.iter().enumerate().rev() {
            let wrench = self.wrenches[number];
            body.motion.each_velocity(|velocity, rate| efforts[velocity] += wrench.along(&rate));
            if let Some(parent) = body.parent {
                let carried = wrench.carried(&self.frames.parent_from_body(number));
                self.wrenches[parent].force += carried.force;
                self.wrenches[parent].torque += carried.torque;
            }
        }
        Ok(())
    }

    /// The mass matrix at the position of the last update: `efforts = mass_matrix · accelerations`, plus
    /// [`Self::efforts`] without accelerations. Symmetric; one row and column for each velocity. It is singular if a joint moves no mass.
    ///
    /// # Errors
    /// The number of rows or columns is not that of the robot's velocities.
    pub fn mass_matrix(&mut self, matrix: &mut DMatrix<f64>) -> Result<(), KinematicsError> {
        let kinematics = self.frames.kinematics();
        let expected = kinematics.velocities();
        for given in [matrix.nrows(), matrix.ncols()] {
            if given != expected {
                return Err(KinematicsError::Coordinates { what: "rows and columns", expected, given });
            }
        }
        matrix.fill(0.0);
        self.composite.copy_from_slice(&self.own);
        for (number, body) in kinematics.bodies.iter().enumerate().rev() {
            let composite = self.composite[number];
            if let Some(parent) = body.parent {
                let carried = composite.carried(&self.frames.parent_from_body(number));
                self.composite[parent].add(&carried);
            }
            body.motion.each_velocity(|column, rate| {
                let mut wrench = Wrench::of_rate(&composite, &rate);
                body.motion.each_velocity(|row, rate| matrix[(row, column)] += wrench.along(&rate));
                let (mut child, mut above) = (number, body.parent);
                while let Some(ancestor) = above {
                    wrench = wrench.carried(&self.frames.parent_from_body(child));
                    let carrier = &kinematics.bodies[ancestor];
                    // Of two bodies that follow one joint, both products count for its diagonal element.
                    carrier.motion.each_velocity(|row, rate| {
                        let product = wrench.along(&rate);
                        matrix[(row, column)] += product;
                        matrix[(column, row)] += product;
                    });
                    (child, above) = (ancestor, carrier.parent);
                }
            });
        }
        Ok(())
    }
}
