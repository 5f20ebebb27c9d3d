//! Effects of gravity: the centre of mass, and the efforts that hold a robot against gravity.

use super::mass::Mass;
use super::tree::Frames;
use super::{KinematicsError, model::check};
use nalgebra::Vector3;

impl Frames {
    /// The mass of all links, kg; 0 if none declares any.
    pub fn mass(&self) -> f64 {
        self.own_masses.iter().map(|own| own.mass).sum()
    }

    /// The centre of mass of the robot in the frame of the root, m; `None` if no link has a mass.
    pub fn centre_of_mass(&self) -> Option<Vector3<f64>> {
        let fixed = self.own_masses.first()?;
        let moments = self.states.iter().zip(self.own_masses.iter().skip(1)).map(|(state, own)| {
            state.root_from_body.rotation * own.moment + state.root_from_body.translation.vector * own.mass
        });
        let moment = moments.fold(fixed.moment, |sum, moment| sum + moment);
        let mass = self.mass();
        (mass > 0.0).then(|| moment / mass)
    }

    /// The efforts that hold the robot at rest in its last position, under a gravity in m/s² in the frame of the
    /// root: (0, 0, −9.8) if its z points up. One for each velocity: N·m for a rotation, N for a translation.
    ///
    /// # Errors
    /// The number of efforts is not that of the robot's velocities.
    pub fn gravity_efforts(&mut self, gravity: &Vector3<f64>, efforts: &mut [f64]) -> Result<(), KinematicsError> {
        check("efforts", self.kinematics().velocities(), efforts)?;
        efforts.fill(0.0);
        let Self { masses, own_masses, .. } = self;
        masses.copy_from_slice(own_masses);
        for number in (0..self.states.len()).rev() {
            let body = self.kinematics().bodies[number];
            let root_from_body = self.states[number].root_from_body;
            let carried = self.masses[number + 1];
            let weight = root_from_body.rotation.inverse() * gravity;
            let (force, torque) = (weight * -carried.mass, carried.moment.cross(&-weight));
            body.motion.each_velocity(|velocity, rate| {
                efforts[velocity] += rate.linear.dot(&force) + rate.angular.dot(&torque);
            });
            let parent_from_body = self.parent_from_body(number);
            let moment =
                parent_from_body.rotation * carried.moment + parent_from_body.translation.vector * carried.mass;
            self.masses[body.parent.map_or(0, |parent| parent + 1)].add(&Mass { mass: carried.mass, moment });
        }
        Ok(())
    }
}
