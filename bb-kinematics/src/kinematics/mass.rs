//! Masses of bodies.

use super::model::Kinematics;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// Mass, and first moment (mass times position of the centre), in the frame of a body.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mass {
    pub(super) mass: f64,
    pub(super) moment: Vector3<f64>,
}

impl Mass {
    pub(super) fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.moment += other.moment;
    }
}

/// The mass of the links fixed to the root, then that of each body.
pub(super) fn own_masses(kinematics: &Kinematics) -> Vec<Mass> {
    let mut masses = vec![Mass::default(); kinematics.bodies.len() + 1];
    for link in &kinematics.links {
        let Some(inertial) = &link.inertial else { continue };
        let centre = link.body_from_link * Point3::from(inertial.link_from_inertia.isometry().translation.vector);
        let mass = Mass { mass: inertial.mass, moment: centre.coords * inertial.mass };
        masses[link.body.map_or(0, |body| body + 1)].add(&mass);
    }
    masses
}

/// Mass, first moment and rotational inertia of a body, in its frame and about its origin.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RigidBody {
    pub(super) mass: f64,
    pub(super) moment: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
}

impl RigidBody {
    pub(super) fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.moment += other.moment;
        self.inertia += other.inertia;
    }

    /// Returns the same body in the frame of another one. With `x' = R x + r`, the inertia `−∫ [x]² dm` becomes
    /// `R I Rᵀ − [r][R h] − [R h][r] − m [r]²`, where `h` is the first moment.
    pub(super) fn carried(&self, other_from_body: &Isometry3<f64>) -> Self {
        let rotation = other_from_body.rotation.to_rotation_matrix();
        let shift = &other_from_body.translation.vector;
        let (turned, lever) = ((rotation * self.moment).cross_matrix(), shift.cross_matrix());
        let inertia = rotation.matrix() * self.inertia * rotation.matrix().transpose()
            - lever * turned
            - turned * lever
            - lever * lever * self.mass;
        Self { mass: self.mass, moment: rotation * self.moment + shift * self.mass, inertia }
    }
}

/// Each body with all links fixed to it; the links fixed to the root move nothing.
pub(super) fn rigid_bodies(kinematics: &Kinematics) -> Vec<RigidBody> {
    let mut bodies = vec![RigidBody::default(); kinematics.bodies.len()];
    for link in &kinematics.links {
        let (Some(inertial), Some(body)) = (&link.inertial, link.body) else { continue };
        let [xx, xy, xz, yy, yz, zz] = inertial.inertia;
        let about_centre = RigidBody {
            mass: inertial.mass,
            moment: Vector3::zeros(),
            inertia: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        };
        bodies[body].add(&about_centre.carried(&(link.body_from_link * inertial.link_from_inertia.isometry())));
    }
    bodies
}
