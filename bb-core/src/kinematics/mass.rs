//! Masses of bodies.

use super::model::Kinematics;
use nalgebra::{Point3, Vector3};

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
